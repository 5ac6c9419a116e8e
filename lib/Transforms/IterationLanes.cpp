// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "IterationLanes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

bool piko::isNumber(Type type) { return type.isIntOrIndexOrFloat(); }

bool OrderedGroup::contains(Operation *op) const {
  if (!first)
    return false;
  op = first->getBlock()->findAncestorOpInBlock(*op);
  return op && !op->isBeforeInBlock(first) && !last->isBeforeInBlock(op);
}

static bool isStructure(Operation *op) {
  return isa<scf::IfOp, scf::ForOp, scf::WhileOp, scf::IndexSwitchOp>(op);
}

IterationLanes::IterationLanes(scf::ForOp loop)
    : loop(loop),
      uniformity(loop, {{loop.getInductionVar(), Uniform::Iteration}}) {
  if (loop.getNumResults() > 0)
    refuse(loop, "it hands values from iteration to iteration");
  if (loop.getUnsignedCmp())
    refuse(loop, "it counts without a sign");
  if (!matchPattern(loop.getStep(), m_One()))
    refuse(loop, "its step is not 1");
  loop.walk([&](StateAccessOpInterface access) {
    if (access.getAccessKinds() != StateAccess::reads)
      written.insert(access.getAccessedState());
  });
  findArrays();
  findSharedPixels();
  checkCarried();
  if (!refusal.at)
    findOrdered();
}

//===----------------------------------------------------------------------===//
// Memory
//===----------------------------------------------------------------------===//

void IterationLanes::findArrays() {
  int64_t bytes = 0;
  loop.walk([&](Operation *op) {
    if (auto array = dyn_cast<memref::AllocaOp>(op)) {
      MemRefType type = array.getType();
      bool isSimple = type.hasStaticShape() && type.getRank() == 1 &&
                      type.getLayout().isIdentity() &&
                      isNumber(type.getElementType());
      for (Operation *user : array->getUsers()) {
        auto store = dyn_cast<memref::StoreOp>(user);
        isSimple &= isa<memref::LoadOp>(user) ||
                    (store && store.getMemRef() == array.getResult());
      }
      if (!isSimple)
        refuse(op, "lanes cannot share this array");
      // A turn of 16 lanes keeps as many of it.
      constexpr int64_t most = 16 << 10;
      Type element = type.getElementType();
      bytes += isSimple ? type.getNumElements() *
                              (element.isIndex()
                                   ? 8
                                   : (element.getIntOrFloatBitWidth() + 7) / 8)
                        : 0;
      if (bytes > most)
        refuse(op, "each lane would have a copy of this array, which is large");
      privates.insert(array);
    } else if (auto store = dyn_cast<memref::StoreOp>(op)) {
      changed.insert(store.getMemRef());
    } else if (op->getNumResults() == 1 &&
               isa<BaseMemRefType>(op->getResult(0).getType())) {
      refuse(op, "it makes a view of memory");
    }
  });
}

bool IterationLanes::readsFixed(Operation *op) const {
  if (auto load = dyn_cast<LoadOp>(op))
    return !written.contains(load.getStateAttr());
  auto load = dyn_cast<memref::LoadOp>(op);
  return load && !isPrivate(load.getMemRef()) &&
         !changed.contains(load.getMemRef()) &&
         !load.getMemRef().getDefiningOp<memref::ViewOp>();
}

/// What is cast to an integer of another width.
static Value stripCasts(Value value) {
  while (isa_and_nonnull<arith::IndexCastOp, arith::ExtSIOp>(
      value.getDefiningOp()))
    value = value.getDefiningOp()->getOperand(0);
  return value;
}

bool IterationLanes::isLinear(Value value) const {
  return isSum(stripCasts(value));
}

/// Sums are of one width: a narrower one may wrap, and go on from elsewhere.
bool IterationLanes::isSum(Value value) const {
  if (stripCasts(value) == loop.getInductionVar())
    return true;
  Operation *op = value.getDefiningOp();
  if (isa_and_nonnull<arith::SubIOp>(op))
    return isSum(op->getOperand(0)) && !isVarying(op->getOperand(1));
  if (!isa_and_nonnull<arith::AddIOp>(op))
    return false;
  Value a = op->getOperand(0), b = op->getOperand(1);
  return (isSum(a) && !isVarying(b)) || (isSum(b) && !isVarying(a));
}

/// Whether a linear value is the same in all turns of inner loops.
bool IterationLanes::isFixed(Value value) const {
  if (value == loop.getInductionVar())
    return true;
  if (Operation *op = value.getDefiningOp(); op && isVarying(value))
    return llvm::all_of(op->getOperands(),
                        [&](Value operand) { return isFixed(operand); });
  for (Operation *at = value.getParentBlock()->getParentOp(); at && at != loop;
       at = at->getParentOp())
    if (isa<scf::ForOp, scf::WhileOp>(at))
      return false;
  return true;
}

/// Updates of one pixel keep their order: lanes must not meet there, neither in
/// one operation nor in two. Where they cannot, all access to the image has the
/// same index that differs from lane to lane, in all turns of inner loops.
void IterationLanes::findSharedPixels() {
  llvm::DenseMap<Attribute, SmallVector<Value>> apart; // by dimension, or null
  loop.walk([&](Operation *op) {
    FlatSymbolRefAttr state;
    ValueRange indices;
    if (auto load = dyn_cast<LoadOp>(op)) {
      state = load.getStateAttr();
      indices = load.getIndices();
    } else if (auto store = dyn_cast<StoreOp>(op)) {
      state = store.getStateAttr();
      indices = store.getIndices();
    } else {
      return;
    }
    if (!written.contains(state) || !lookupInPipeline<ImageOp>(op, state))
      return;
    auto [found, isFirst] = apart.try_emplace(state, indices);
    for (auto [known, index] : llvm::zip(found->second, indices))
      if (known && (known != index || !isLinear(index) || !isFixed(index)))
        known = {};
  });
  for (auto &[state, indices] : apart)
    if (llvm::none_of(indices, [](Value index) { return bool(index); }))
      shared.insert(state);
}

bool IterationLanes::isAccess(Operation *op) const {
  if (auto load = dyn_cast<memref::LoadOp>(op))
    return load.getMemRefType().getRank() == 1 &&
           load.getMemRefType().getLayout().isIdentity() &&
           !load.getType().isInteger(1);
  if (auto store = dyn_cast<memref::StoreOp>(op))
    return store.getMemRefType().getRank() == 1 &&
           store.getMemRefType().getLayout().isIdentity() &&
           !store.getMemRefType().getElementType().isInteger(1);
  auto isSimple = [&](auto access, Type type) {
    return access.getChecked() && !access.getTile() && !type.isInteger(1) &&
           llvm::none_of(access.getElements(),
                         [&](Value element) { return isVarying(element); });
  };
  if (auto load = dyn_cast<LoadOp>(op))
    return isSimple(load, load.getType());
  if (auto store = dyn_cast<StoreOp>(op))
    return isSimple(store, store.getValue().getType());
  return false;
}

//===----------------------------------------------------------------------===//
// Forms
//===----------------------------------------------------------------------===//

/// Functions that are exact, or the same for a vector as for a number.
static bool hasVectorForm(Operation *op) {
  if (!OpTrait::hasElementwiseMappableTraits(op))
    return false;
  if (op->getDialect() == op->getContext()->getLoadedDialect("math"))
    return isa<math::SqrtOp, math::FloorOp, math::CeilOp, math::TruncOp,
               math::RoundEvenOp, math::AbsFOp, math::AbsIOp, math::CopySignOp,
               math::FmaOp, math::CountLeadingZerosOp,
               math::CountTrailingZerosOp, math::CtPopOp>(op);
  return isa<arith::ArithDialect>(op->getDialect());
}

/// Whether it does not matter which lane does it first.
static bool isUnordered(Operation *op) {
  if (isMemoryEffectFree(op))
    return true;
  if (auto access = dyn_cast<StateAccessOpInterface>(op))
    return access.getAccessKinds() == StateAccess::reads ||
           access.getAccessKinds() == StateAccess::changesAtomically ||
           access.getAccessKinds() == StateAccess::stores;
  return isa<memref::LoadOp, memref::StoreOp, FailOp, FailListOp, FailDivideOp,
             PrefetchOp>(op);
}

LaneForm IterationLanes::getForm(Operation *op) const {
  if (isStructure(op))
    return LaneForm::Structure;
  if (isa<memref::AllocaOp>(op))
    return LaneForm::Private;
  if (auto access = dyn_cast<StateAccessOpInterface>(op))
    if (shared.contains(access.getAccessedState()))
      return LaneForm::Ordered;
  auto varies = [&](Value value) { return isVarying(value); };
  bool isUniform = op->getNumRegions() == 0 && op->getNumResults() > 0 &&
                   llvm::none_of(op->getResults(), varies);
  if (isUniform && (isMemoryEffectFree(op) || isa<LoadOp>(op)))
    return LaneForm::Uniform;
  if (isAccess(op))
    return LaneForm::Access;
  if (hasVectorForm(op) && llvm::all_of(op->getOperandTypes(), isNumber) &&
      llvm::all_of(op->getResultTypes(), isNumber))
    return LaneForm::Vector;
  if (op->getNumRegions() == 0 && isPure(op) &&
      !llvm::all_of(op->getResultTypes(), isNumber))
    return LaneForm::Lazy;
  return isUnordered(op) ? LaneForm::Serial : LaneForm::Ordered;
}

/// What may trap, or takes as long for one lane as for all.
static bool isDivision(Operation *op) {
  return isa<arith::DivSIOp, arith::DivUIOp, arith::RemSIOp, arith::RemUIOp,
             arith::CeilDivSIOp, arith::CeilDivUIOp, arith::FloorDivSIOp,
             arith::DivFOp, math::SqrtOp>(op);
}

bool IterationLanes::isCheap(Region &region) const {
  constexpr int64_t most = 12;
  int64_t count = 0;
  for (Operation &op : region.front().without_terminator()) {
    LaneForm form = getForm(&op);
    bool isFree =
        form == LaneForm::Vector || (form == LaneForm::Uniform && isPure(&op));
    if (!isFree || isDivision(&op) || ordered.contains(&op) || ++count > most)
      return false;
  }
  return true;
}

//===----------------------------------------------------------------------===//
// Order
//===----------------------------------------------------------------------===//

void IterationLanes::checkCarried() {
  loop.walk([&](Operation *op) {
    if (op == loop || !isStructure(op))
      return;
    auto isOther = [&](Value value) {
      return isVarying(value) && !isNumber(value.getType());
    };
    bool isBad = llvm::any_of(op->getResults(), isOther);
    for (Region &region : op->getRegions())
      for (Value argument : region.getArguments())
        isBad |= isOther(argument);
    if (isBad)
      refuse(op, "it chooses between what are no numbers");
  });
}

void IterationLanes::findOrdered() {
  SmallVector<Operation *> all;
  loop.walk([&](Operation *op) {
    if (op != loop && !op->hasTrait<OpTrait::IsTerminator>() &&
        getForm(op) == LaneForm::Ordered)
      all.push_back(op);
  });
  if (all.empty())
    return;
  // The innermost block around all of them that no loop repeats.
  Block *block = all.front()->getBlock();
  auto leave = [&] { block = block->getParentOp()->getBlock(); };
  for (Operation *op : all)
    while (!block->findAncestorOpInBlock(*op))
      leave();
  for (Operation *at = block->getParentOp(); at != loop; at = at->getParentOp())
    if (isa<scf::ForOp, scf::WhileOp>(at) || !isStructure(at))
      block = at->getBlock();
  for (Operation *op : all) {
    op = block->findAncestorOpInBlock(*op);
    if (!ordered.first || op->isBeforeInBlock(ordered.first))
      ordered.first = op;
    if (!ordered.last || ordered.last->isBeforeInBlock(op))
      ordered.last = op;
  }
}

IterationLanes::Cost IterationLanes::getCost() const {
  constexpr int64_t insideLoop = 8;
  Cost cost;
  loop.walk([&](Operation *op) {
    if (op == loop || isStructure(op) || op->hasTrait<OpTrait::IsTerminator>())
      return;
    if (isa<FailOp, FailListOp, FailDivideOp>(op))
      return; // rare
    int64_t weight = 1;
    for (Operation *at = op->getParentOp(); at != loop; at = at->getParentOp())
      if (isa<scf::ForOp, scf::WhileOp>(at))
        weight *= insideLoop;
    LaneForm form = getForm(op);
    if (form == LaneForm::Vector)
      cost.computations += weight;
    if (form == LaneForm::Vector || form == LaneForm::Access)
      cost.vectors += weight;
    else if (form == LaneForm::Serial || form == LaneForm::Ordered)
      cost.serial += weight;
  });
  return cost;
}
