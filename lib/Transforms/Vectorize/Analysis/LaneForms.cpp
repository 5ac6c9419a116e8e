// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What lanes share stays scalar, also what loops hand on, where all lanes that
// are still in the loop began with the same, such as the place of an insertion.
// The rest becomes vectors:
//
//   * access to state and to primitives becomes gathers and scatters, or masked
//     loads and stores of rows;
//   * a local array has a column for each lane, and one of up to 16 elements is
//     accessed row by row, also where lanes are in different places;
//   * a side of a condition gets no branch around it if it is short, and in
//     strips of convex shapes (piko-narrow-integers) up to 64 instructions;
//   * an inner loop, or two of which one is all that the other does, is
//     collapsed where lanes make different numbers of iterations, which hand on
//     nothing and change state by atomic operations alone.
//
// Barriers need no code: lanes come to them together. Where they may not, or
// where what comes before one keeps the order of iterations, a loop is refused.

#include "Vectorize/Analysis/LaneForms.h"

#include "Vectorize/Analysis/Lanes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoApproximation.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

static bool isNumberType(Type type) { return type.isIntOrIndexOrFloat(); }

bool piko::isLaneType(Type type) {
  return isNumberType(type) || isa<PrimType>(type);
}

bool piko::isOneVector(scf::ForOp loop, int64_t laneCount) {
  auto least = loop.getUpperBound().getDefiningOp<arith::MinSIOp>();
  if (!least)
    return false;
  return llvm::any_of(least->getOperands(), [&](Value bound) {
    auto after = bound.getDefiningOp<arith::AddIOp>();
    std::optional<int64_t> width =
        after ? getConstantIntValue(after.getRhs()) : std::nullopt;
    return width && *width <= laneCount &&
           after.getLhs() == loop.getLowerBound() &&
           bitEnumContainsAll(after.getOverflowFlags(),
                              arith::IntegerOverflowFlags::nsw);
  });
}

bool piko::isPrefetch(Operation *op) {
  return isa<PrefetchOp, PrefetchItemOp>(op);
}

bool piko::asksAhead(scf::ForOp loop) {
  return !isOverPrimitives(loop) &&
         loop->walk([](PrefetchOp) { return WalkResult::interrupt(); })
             .wasInterrupted();
}

bool piko::isStructure(Operation *op) {
  return isa<scf::IfOp, scf::ForOp, scf::WhileOp, scf::IndexSwitchOp>(op);
}

bool piko::hasVectorForm(Operation *op) {
  if (!OpTrait::hasElementwiseMappableTraits(op))
    return false;
  if (op->getDialect() == op->getContext()->getLoadedDialect("math"))
    return isa<math::SqrtOp, math::FloorOp, math::CeilOp, math::TruncOp,
               math::RoundEvenOp, math::AbsFOp, math::AbsIOp, math::CopySignOp,
               math::FmaOp, math::CountLeadingZerosOp,
               math::CountTrailingZerosOp, math::CtPopOp>(op);
  return isApproximation(op) || isa<arith::ArithDialect>(op->getDialect());
}

LaneForms::LaneForms(scf::ForOp loop, int64_t laneCount)
    : loop(loop), laneCount(laneCount),
      roots{{loop.getInductionVar(), Uniform::Iteration}},
      uniformity(loop, roots, /*isLockstep=*/true) {
  loop.walk([&](StateAccessOpInterface access) {
    if (access.getAccessKinds() != StateAccess::reads)
      written.insert(access.getAccessedState());
  });
}

void LaneForms::split(ArrayRef<Value> arrays) {
  for (Value array : arrays)
    roots.emplace_back(array, Uniform::Iteration);
  uniformity = Uniformity(loop, roots, /*isLockstep=*/true);
}

void LaneForms::findForms() {
  refusal = {};
  if (loop.getNumResults() > 0)
    refuse(loop, "it hands values from iteration to iteration");
  if (loop.getUnsignedCmp())
    refuse(loop, "it counts without a sign");
  if (!matchPattern(loop.getStep(), m_One()))
    refuse(loop, "its step is not 1");
  privates.clear();
  changed.clear();
  findArrays();
  nests.clear();
  findNests();
  shared.clear();
  findSharedPixels();
  checkCarried();
}

//===----------------------------------------------------------------------===//
// Memory
//===----------------------------------------------------------------------===//

void LaneForms::findArrays() {
  int64_t bytes = 0;
  loop.walk([&](Operation *op) {
    if (auto array = dyn_cast<memref::AllocaOp>(op)) {
      MemRefType type = array.getType();
      bool isSimple = type.hasStaticShape() && type.getRank() == 1 &&
                      type.getLayout().isIdentity() &&
                      isNumberType(type.getElementType());
      for (Operation *user : array->getUsers()) {
        auto store = dyn_cast<memref::StoreOp>(user);
        isSimple &= isa<memref::LoadOp>(user) ||
                    (store && store.getMemRef() == array.getResult());
      }
      if (!isSimple)
        refuse(op, "lanes cannot share this array");
      // An iteration keeps one for each lane.
      constexpr int64_t most = 16 << 10;
      Type element = type.getElementType();
      bytes += isSimple && isVarying(array)
                   ? type.getNumElements() *
                         (element.isIndex()
                              ? 8
                              : (element.getIntOrFloatBitWidth() + 7) / 8)
                   : 0;
      if (bytes > most)
        refuse(op, "each lane would have a copy of this array, which is large");
      privates.insert(array);
    } else if (auto store = dyn_cast<memref::StoreOp>(op)) {
      changed.insert(store.getMemRef());
    } else if (auto push = dyn_cast<PushOp>(op)) {
      changed.insert_range(push.getArrays());
    } else if (op->getNumResults() == 1 &&
               isa<BaseMemRefType>(op->getResult(0).getType())) {
      refuse(op, "it makes a view of memory");
    }
  });
}

bool LaneForms::isShort(Value array) const {
  constexpr int64_t most = 16;
  return cast<MemRefType>(array.getType()).getNumElements() <= most;
}

bool LaneForms::readsFixed(Operation *op) const {
  if (auto load = dyn_cast<LoadOp>(op))
    return !written.contains(load.getStateAttr());
  auto load = dyn_cast<memref::LoadOp>(op);
  return load && !isPrivate(load.getMemRef()) &&
         !changed.contains(load.getMemRef()) &&
         !load.getMemRef().getDefiningOp<memref::ViewOp>();
}

/// What is cast to an integer of another width.
static Value stripSignedCasts(Value value) {
  while (isa_and_nonnull<arith::IndexCastOp, arith::ExtSIOp>(
      value.getDefiningOp()))
    value = value.getDefiningOp()->getOperand(0);
  return value;
}

bool LaneForms::isLinear(Value value) const {
  return isSum(stripSignedCasts(value));
}

/// Sums are of one width: a narrower one may wrap, and go on from elsewhere.
bool LaneForms::isSum(Value value) const {
  if (stripSignedCasts(value) == loop.getInductionVar())
    return true;
  Operation *op = value.getDefiningOp();
  if (isa_and_nonnull<arith::SubIOp>(op))
    return isSum(op->getOperand(0)) && !isVarying(op->getOperand(1));
  if (!isa_and_nonnull<arith::AddIOp>(op))
    return false;
  Value a = op->getOperand(0), b = op->getOperand(1);
  return (isSum(a) && !isVarying(b)) || (isSum(b) && !isVarying(a));
}

/// Whether a linear value is the same in all iterations of inner loops.
bool LaneForms::isFixed(Value value) const {
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
/// same index that differs from lane to lane, in all iterations of inner loops.
void LaneForms::findSharedPixels() {
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
  llvm::DenseMap<Attribute, Value> places; // in arrays of a bin's pixels
  loop.walk([&](memref::StoreOp store) {
    if (Attribute pixels = getPixels(store)) {
      Value place = store.getIndices().front();
      Value known = places.try_emplace(pixels, place).first->second;
      if (known != place || !isLinear(place) || !isFixed(place))
        shared.insert(pixels);
    }
  });
}

Attribute piko::getPixels(memref::StoreOp store) {
  Operation *array = store.getMemRef().getDefiningOp();
  return array ? array->getAttr(marks::pixels) : Attribute();
}

bool LaneForms::isAccess(Operation *op) const {
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
  if (auto get = dyn_cast<GetOp>(op))
    return !get.getType().isInteger(1) && isVarying(get.getPrim()) &&
           llvm::none_of(get.getElements(),
                         [&](Value element) { return isVarying(element); });
  return isa<ItemOp>(op);
}

//===----------------------------------------------------------------------===//
// Barriers
//===----------------------------------------------------------------------===//

/// What a barrier combines the values of lanes by.
void LaneForms::checkCombination(Operation *barrier) {
  if (barrier->getNumRegions() == 0)
    return;
  for (Operation &op : barrier->getRegion(0).front().without_terminator()) {
    if (!hasVectorForm(&op))
      refuse(&op, "it has no vector form");
    else if (llvm::any_of(op.getOperands(),
                          [&](Value operand) { return isVarying(operand); }))
      refuse(&op, "it combines by what differs between lanes");
  }
}

/// Lanes are at one place at a time, and so meet at each barrier if they go
/// there together, and nothing that comes before it is put off.
void LaneForms::checkBarriers() {
  Operation *ordered = nullptr;
  loop.walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (op == loop || op->hasTrait<OpTrait::IsTerminator>())
      return WalkResult::advance();
    bool isVector =
        llvm::any_of(op->getResultTypes(), llvm::IsaPred<VectorType>);
    if (isa<ParallelLoopOpInterface>(op) || isVector) {
      refuse(op, isVector ? "there are vectors inside, as iterations have that "
                            "meet at barriers"
                          : "iterations meet inside");
      return WalkResult::interrupt();
    }
    if (isa<scf::ForOp, scf::WhileOp>(op) && findBarrier(op))
      op->walk([&](Operation *inner) {
        if (getForm(inner) == LaneForm::Ordered)
          ordered = inner;
      });
    if (getForm(op) == LaneForm::Ordered)
      ordered = op;
    if (!isBarrier(op))
      return WalkResult::advance();
    if (!isa<SyncOp, ReduceOp, ScanOp, SortOp>(op))
      refuse(op, "lanes have no such barrier");
    else if (Operation *parting = uniformity.findParting(op, loop.getRegion()))
      refuse(parting, "iterations may not go to a barrier together");
    else if (ordered)
      refuse(ordered,
             "it keeps the order of iterations, and a barrier follows");
    else
      checkCombination(op);
    return WalkResult::skip();
  });
}

//===----------------------------------------------------------------------===//
// Nests
//===----------------------------------------------------------------------===//

/// Whether the iterations of a loop may change places, also with those of other
/// lanes: they hand on nothing, and change each piece of state by atomic
/// operations of one kind alone.
bool LaneForms::canCollapse(scf::ForOp inner) const {
  if (inner.getNumResults() > 0 || inner.getUnsignedCmp() ||
      !matchPattern(inner.getStep(), m_One()))
    return false;
  llvm::DenseMap<Attribute, AtomicKind> kinds;
  WalkResult result = inner.walk([&](Operation *op) {
    bool isFree = isMemoryEffectFree(op) || op->getNumRegions() > 0 ||
                  op->hasTrait<Failure>() || isPrefetch(op);
    for (Value operand : op->getOperands())
      isFree &= !isVarying(operand) || isLaneType(operand.getType());
    if (auto access = dyn_cast<StateAccessOpInterface>(op)) {
      bool isRead = access.getAccessKinds() == StateAccess::reads &&
                    !written.contains(access.getAccessedState());
      auto atomic = dyn_cast<AtomicOp>(op);
      bool isOfOneKind =
          atomic && kinds.try_emplace(atomic.getStateAttr(), atomic.getKind())
                            .first->second == atomic.getKind();
      isFree = isRead || (isOfOneKind && !atomic.getOld() &&
                          atomic.getKind() != AtomicKind::AddF);
    } else if (isa<memref::LoadOp>(op)) {
      isFree = readsFixed(op);
    }
    return isFree && !isa<memref::AllocaOp>(op) ? WalkResult::advance()
                                                : WalkResult::interrupt();
  });
  return !result.wasInterrupted();
}

void LaneForms::findNests() {
  SmallVector<Uniformity::Root> roots(this->roots);
  loop.walk<WalkOrder::PreOrder>([&](scf::ForOp outer) {
    if (outer == loop || !canCollapse(outer))
      return WalkResult::advance();
    SmallVector<scf::ForOp> nest{outer};
    // A second loop, whose bounds are those of the first, with nothing around
    // it but computation.
    auto inner = llvm::to_vector(outer.getBody()->getOps<scf::ForOp>());
    auto isKnown = [&](Value bound) {
      return !outer->isAncestor(bound.getParentBlock()->getParentOp());
    };
    bool isOnly = inner.size() == 1 && isKnown(inner[0].getLowerBound()) &&
                  isKnown(inner[0].getUpperBound());
    for (Operation &op : outer.getBody()->without_terminator())
      isOnly &= isa<scf::ForOp>(op) || isPure(&op);
    if (isOnly)
      nest.push_back(inner[0]);
    if (llvm::all_of(nest, [&](scf::ForOp one) { return isSharedLoop(one); }))
      return WalkResult::advance();
    for (scf::ForOp one : nest)
      roots.emplace_back(one.getInductionVar(), Uniform::Iteration);
    nests[outer] = nest;
    return WalkResult::skip();
  });
  if (!nests.empty())
    uniformity = Uniformity(loop, roots, /*isLockstep=*/true);
}

//===----------------------------------------------------------------------===//
// Forms
//===----------------------------------------------------------------------===//

/// Whether it does not matter which lane does it first.
static bool isUnordered(Operation *op) {
  if (isMemoryEffectFree(op))
    return true;
  if (auto access = dyn_cast<StateAccessOpInterface>(op))
    return access.getAccessKinds() == StateAccess::reads ||
           access.getAccessKinds() == StateAccess::changesAtomically ||
           access.getAccessKinds() == StateAccess::stores;
  return isa<memref::LoadOp, memref::StoreOp, FailOp, FailListOp, FailDivideOp>(
      op);
}

LaneForm LaneForms::getForm(Operation *op) const {
  if (isStructure(op))
    return LaneForm::Structure;
  if (isPrefetch(op))
    return asksAhead(loop) ? LaneForm::Access : LaneForm::Lazy;
  if (isBarrier(op))
    return LaneForm::Barrier;
  if (auto array = dyn_cast<memref::AllocaOp>(op))
    return isVarying(array) ? LaneForm::Private : LaneForm::Uniform;
  if (auto store = dyn_cast<memref::StoreOp>(op);
      store && isPrivate(store.getMemRef()) && !isVarying(store.getMemRef()))
    return LaneForm::Uniform;
  if (auto access = dyn_cast<StateAccessOpInterface>(op))
    if (shared.contains(access.getAccessedState()))
      return LaneForm::Ordered;
  if (auto store = dyn_cast<memref::StoreOp>(op))
    if (Attribute pixels = getPixels(store); pixels && shared.contains(pixels))
      return LaneForm::Ordered;
  auto varies = [&](Value value) { return isVarying(value); };
  if (auto vote = dyn_cast<VoteOp>(op); vote && varies(vote.getCondition()))
    return LaneForm::Vector;
  bool isUniform = op->getNumRegions() == 0 && op->getNumResults() > 0 &&
                   llvm::none_of(op->getResults(), varies);
  if (isUniform && (isMemoryEffectFree(op) || isa<LoadOp, memref::LoadOp>(op)))
    return LaneForm::Uniform;
  if (isAccess(op) || isa<PushOp>(op))
    return LaneForm::Access;
  if (isa<ElectOp>(op))
    return LaneForm::Vector;
  if (hasVectorForm(op) && llvm::all_of(op->getOperandTypes(), isLaneType) &&
      llvm::all_of(op->getResultTypes(), isLaneType))
    return LaneForm::Vector;
  if (op->getNumRegions() == 0 && isPure(op) &&
      !llvm::all_of(op->getResultTypes(), isLaneType))
    return LaneForm::Lazy;
  return isUnordered(op) ? LaneForm::Serial : LaneForm::Ordered;
}

bool LaneForms::isSharedLoop(Operation *op) const {
  if (auto inner = dyn_cast<scf::ForOp>(op))
    return !isVarying(inner.getLowerBound()) &&
           !isVarying(inner.getUpperBound()) && !isVarying(inner.getStep());
  return !isVarying(cast<scf::WhileOp>(op).getConditionOp().getCondition());
}

bool piko::isIntegerDivision(Operation *op) {
  return isa<arith::DivSIOp, arith::DivUIOp, arith::RemSIOp, arith::RemUIOp,
             arith::CeilDivSIOp, arith::CeilDivUIOp, arith::FloorDivSIOp>(op);
}

bool piko::isDividedAsFloats(Operation *op) {
  return isa<arith::DivUIOp, arith::RemUIOp, arith::DivSIOp, arith::RemSIOp>(
             op) &&
         op->getResult(0).getType().isInteger(32);
}

bool piko::isDivision(Operation *op) {
  return isIntegerDivision(op) || isa<arith::DivFOp, math::SqrtOp>(op);
}

void LaneForms::checkCarried() {
  loop.walk([&](Operation *op) {
    if (op == loop || !isStructure(op))
      return;
    auto isOther = [&](Value value) {
      return isVarying(value) && !isLaneType(value.getType());
    };
    bool isBad = llvm::any_of(op->getResults(), isOther);
    for (Region &region : op->getRegions())
      for (Value argument : region.getArguments())
        isBad |= isOther(argument);
    if (isBad)
      refuse(op, "it chooses between what are no numbers");
  });
}

/// Whether all accesses to a row of lanes' elements are one after the other.
bool LaneForms::isRow(Operation *op) const {
  if (auto load = dyn_cast<memref::LoadOp>(op))
    return isPrivate(load.getMemRef()) ? !isVarying(load.getIndices()[0])
                                       : isLinear(load.getIndices()[0]);
  if (auto store = dyn_cast<memref::StoreOp>(op))
    return isPrivate(store.getMemRef()) ? !isVarying(store.getIndices()[0])
                                        : isLinear(store.getIndices()[0]);
  if (auto item = dyn_cast<ItemOp>(op))
    return isLinear(item.getPosition());
  auto isOfRow = [&](ValueRange indices) {
    return !indices.empty() && isLinear(indices.front()) &&
           llvm::none_of(indices.drop_front(),
                         [&](Value index) { return isVarying(index); });
  };
  if (auto load = dyn_cast<LoadOp>(op))
    return isOfRow(load.getIndices());
  if (auto atomic = dyn_cast<AtomicOp>(op))
    return isOfRow(atomic.getIndices());
  auto store = dyn_cast<StoreOp>(op);
  return store && isOfRow(store.getIndices());
}

bool LaneForms::isPrivateRow(Operation *op) const {
  auto atomic = dyn_cast<AtomicOp>(op);
  return atomic && atomic.getCopy() && !atomic.getOld() &&
         loop.isDefinedOutsideOfLoop(atomic.getCopy()) && isRow(op) &&
         llvm::none_of(atomic.getElements(),
                       [&](Value element) { return isVarying(element); });
}

//===----------------------------------------------------------------------===//
// Rows with ends
//===----------------------------------------------------------------------===//

/// Whether a value grows by one from lane to lane but where it is limited: by
/// a clamp, a remainder or a choice.
bool LaneForms::isLimited(Value value) const {
  if (!isVarying(value) || isLinear(value))
    return isVarying(value);
  Operation *op = value.getDefiningOp();
  if (!op)
    return false;
  auto isPart = [&](Value part) { return !isVarying(part) || isLimited(part); };
  if (isa<arith::IndexCastOp, arith::ExtSIOp, arith::ExtUIOp>(op))
    return isLimited(op->getOperand(0));
  if (isa<arith::AddIOp, arith::MinSIOp, arith::MaxSIOp, arith::MinUIOp,
          arith::MaxUIOp>(op))
    return isVarying(op->getOperand(0)) != isVarying(op->getOperand(1)) &&
           llvm::all_of(op->getOperands(), isPart);
  if (isa<arith::SubIOp, arith::RemSIOp, arith::RemUIOp>(op))
    return isLimited(op->getOperand(0)) && !isVarying(op->getOperand(1));
  if (auto choice = dyn_cast<arith::SelectOp>(op))
    return isPart(choice.getTrueValue()) && isPart(choice.getFalseValue());
  return false;
}

Value LaneForms::findLimited(Operation *op) const {
  auto load = dyn_cast<LoadOp>(op);
  if (!load || load.getIndices().empty() || isRow(op) ||
      llvm::any_of(load.getIndices().drop_front(),
                   [&](Value index) { return isVarying(index); }))
    return {};
  Value index = load.getIndices().front();
  if (!isLimited(index))
    return {};
  // What is the same for all lanes changes nothing, but for the test.
  while (auto cast = index.getDefiningOp<arith::IndexCastOp>())
    index = cast.getIn();
  while (auto sum = index.getDefiningOp<arith::AddIOp>())
    index = sum.getOperand(isVarying(sum.getLhs()) ? 0 : 1);
  return index;
}
