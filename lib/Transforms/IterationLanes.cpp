// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "IterationLanes.h"

#include "Lanes.h"

#include "Piko/Dialect/Piko/IR/PikoApproximation.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/Matchers.h"
#include "llvm/ADT/MapVector.h"

using namespace mlir;
using namespace piko;

static bool isNumber(Type type) { return type.isIntOrIndexOrFloat(); }

bool piko::isLaneType(Type type) {
  return isNumber(type) || isa<PrimType>(type);
}

bool OrderedGroup::contains(Operation *op) const {
  if (!first)
    return false;
  op = first->getBlock()->findAncestorOpInBlock(*op);
  return op && !op->isBeforeInBlock(first) && !last->isBeforeInBlock(op);
}

SmallVector<Operation *> OrderedGroup::getOperations() const {
  SmallVector<Operation *> ops;
  for (Operation *op = first;; op = op->getNextNode()) {
    ops.push_back(op);
    if (op == last)
      return ops;
  }
}

/// What only asks for memory ahead of time: a vector's loads do so themselves.
static bool isPrefetch(Operation *op) {
  return isa<PrefetchOp, PrefetchItemOp>(op);
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
  findNests();
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
  if (auto get = dyn_cast<GetOp>(op))
    return !get.getType().isInteger(1) && isVarying(get.getPrim()) &&
           llvm::none_of(get.getElements(),
                         [&](Value element) { return isVarying(element); });
  return isa<ItemOp>(op);
}

//===----------------------------------------------------------------------===//
// Nests
//===----------------------------------------------------------------------===//

/// Whether the turns of a loop may change places, also with those of other
/// lanes: they hand on nothing, and change state by atomic operations alone.
bool IterationLanes::canCollapse(scf::ForOp inner) const {
  if (inner.getNumResults() > 0 || inner.getUnsignedCmp() ||
      !matchPattern(inner.getStep(), m_One()))
    return false;
  WalkResult result = inner.walk([&](Operation *op) {
    bool isFree = isMemoryEffectFree(op) || op->getNumRegions() > 0 ||
                  op->hasTrait<Failure>() || isPrefetch(op);
    for (Value operand : op->getOperands())
      isFree &= !isVarying(operand) || isLaneType(operand.getType());
    if (auto access = dyn_cast<StateAccessOpInterface>(op)) {
      bool isRead = access.getAccessKinds() == StateAccess::reads &&
                    !written.contains(access.getAccessedState());
      bool isAtomic =
          access.getAccessKinds() == StateAccess::changesAtomically &&
          op->getNumResults() == 0;
      isFree = isRead || isAtomic;
    } else if (isa<memref::LoadOp>(op)) {
      isFree = readsFixed(op);
    }
    return isFree && !isa<memref::AllocaOp>(op) ? WalkResult::advance()
                                                : WalkResult::interrupt();
  });
  return !result.wasInterrupted();
}

void IterationLanes::findNests() {
  SmallVector<Uniformity::Root> roots{
      {loop.getInductionVar(), Uniform::Iteration}};
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
    uniformity = Uniformity(loop, roots);
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
  return isApproximation(op) || isa<arith::ArithDialect>(op->getDialect());
}

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

LaneForm IterationLanes::getForm(Operation *op) const {
  if (isStructure(op))
    return LaneForm::Structure;
  if (isPrefetch(op))
    return LaneForm::Lazy;
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
  if (hasVectorForm(op) && llvm::all_of(op->getOperandTypes(), isLaneType) &&
      llvm::all_of(op->getResultTypes(), isLaneType))
    return LaneForm::Vector;
  if (op->getNumRegions() == 0 && isPure(op) &&
      !llvm::all_of(op->getResultTypes(), isLaneType))
    return LaneForm::Lazy;
  return isUnordered(op) ? LaneForm::Serial : LaneForm::Ordered;
}

bool IterationLanes::isSharedLoop(Operation *op) const {
  if (auto inner = dyn_cast<scf::ForOp>(op))
    return !isVarying(inner.getLowerBound()) &&
           !isVarying(inner.getUpperBound()) && !isVarying(inner.getStep());
  return !isVarying(cast<scf::WhileOp>(op).getConditionOp().getCondition());
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
    if (!isFree || isDivision(&op) || findGroup(&op) || ++count > most)
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

const OrderedGroup *IterationLanes::findGroup(Operation *op) const {
  for (const OrderedGroup &group : groups)
    if (group.contains(op))
      return &group;
  return nullptr;
}

/// Whether all that an operation does may be done in front of others.
bool IterationLanes::isMovable(Operation *op) const {
  WalkResult result = op->walk([&](Operation *inner) {
    LaneForm form = getForm(inner);
    bool isFree = inner->hasTrait<OpTrait::IsTerminator>() ||
                  form == LaneForm::Vector || form == LaneForm::Lazy ||
                  form == LaneForm::Uniform || form == LaneForm::Structure ||
                  (form == LaneForm::Access && readsFixed(inner)) ||
                  (form == LaneForm::Serial && isMemoryEffectFree(inner));
    return isFree ? WalkResult::advance() : WalkResult::interrupt();
  });
  return !result.wasInterrupted();
}

llvm::SetVector<Operation *>
IterationLanes::findMovable(ArrayRef<Operation *> ops) const {
  llvm::SetVector<Operation *> movable;
  llvm::DenseSet<Operation *> inGroup(ops.begin(), ops.end());
  Block *block = ops.front()->getBlock();
  for (Operation *op : ops) {
    bool isReady = isMovable(op);
    op->walk([&](Operation *inner) {
      for (Value operand : inner->getOperands()) {
        Operation *from = operand.getDefiningOp();
        from = from ? block->findAncestorOpInBlock(*from) : nullptr;
        isReady &= !from || from == op || !inGroup.contains(from) ||
                   movable.contains(from);
      }
    });
    if (isReady)
      movable.insert(op);
  }
  return movable;
}

llvm::SetVector<Operation *>
IterationLanes::findTurns(const OrderedGroup &group) const {
  SmallVector<Operation *> ops = group.getOperations();
  llvm::SetVector<Operation *> rest(ops.begin(), ops.end());
  for (Operation *op : findMovable(ops))
    rest.remove(op);
  return rest;
}

void IterationLanes::findGroups(Block &block,
                                const llvm::DenseSet<Operation *> &ops,
                                SmallVectorImpl<OrderedGroup> &found) const {
  OrderedGroup group;
  SmallVector<Operation *> choices;
  for (Operation &op : block.without_terminator()) {
    bool holdsAny = op.walk([&](Operation *inner) {
                        return ops.contains(inner) ? WalkResult::interrupt()
                                                   : WalkResult::advance();
                      }).wasInterrupted();
    if (!holdsAny)
      continue;
    if (isa<scf::IfOp, scf::IndexSwitchOp>(op)) {
      choices.push_back(&op);
      continue;
    }
    if (!group)
      group.first = &op;
    group.last = &op;
  }
  // A condition between two of a group is a part of it.
  bool isAdded = !group;
  for (Operation *choice : choices) {
    if (group.contains(choice))
      continue;
    if (!isAdded && group.last->isBeforeInBlock(choice)) {
      found.push_back(group);
      isAdded = true;
    }
    for (Region &region : choice->getRegions())
      if (!region.empty())
        findGroups(region.front(), ops, found);
  }
  if (!isAdded)
    found.push_back(group);
}

bool IterationLanes::canDefer(const OrderedGroup &group,
                              const llvm::SetVector<Operation *> &rest) const {
  Block *block = group.first->getBlock();
  auto isInRest = [&](Operation *op) {
    op = block->findAncestorOpInBlock(*op);
    return op && rest.contains(op);
  };
  bool canBe = true;
  for (Operation *op : rest) {
    // Nothing that vectors do needs a result.
    for (Operation *user : op->getUsers())
      canBe &= isInRest(user);
    // Numbers and primitives are kept until then.
    op->walk([&](Operation *inner) {
      for (Value operand : inner->getOperands()) {
        Operation *from = operand.getDefiningOp();
        bool isOutside =
            !loop->isAncestor(operand.getParentBlock()->getParentOp());
        canBe &= isOutside || isLaneType(operand.getType()) ||
                 isPrivate(operand) || (from && isInRest(from)) ||
                 (from && getForm(from) == LaneForm::Lazy);
      }
    });
  }
  return canBe;
}

namespace {

/// Whether memory is used where it stands, or later, in the order of lanes.
struct Uses {
  bool inPlace = false, deferred = false, changed = false, isAtomic = true;

  bool isInOrder() const {
    return !inPlace || !deferred || !changed || isAtomic;
  }
};

} // namespace

bool IterationLanes::canDefer(ArrayRef<OrderedGroup> groups) const {
  llvm::DenseSet<Operation *> later;
  for (const OrderedGroup &group : groups) {
    llvm::SetVector<Operation *> rest = findTurns(group);
    if (!canDefer(group, rest))
      return false;
    later.insert(rest.begin(), rest.end());
  }
  llvm::DenseMap<Attribute, Uses> states;
  llvm::DenseMap<Value, Uses> arrays;
  auto note = [&](Uses &uses, Operation *op, bool changes, bool isAtomic) {
    bool isLater = false;
    for (Operation *at = op; at != loop && !isLater; at = at->getParentOp())
      isLater = later.contains(at);
    (isLater ? uses.deferred : uses.inPlace) = true;
    uses.changed |= changes;
    uses.isAtomic &= isAtomic;
    return isLater;
  };
  loop.walk([&](Operation *op) {
    if (auto access = dyn_cast<StateAccessOpInterface>(op)) {
      int kinds = access.getAccessKinds();
      note(states[access.getAccessedState()], op, kinds != StateAccess::reads,
           kinds == StateAccess::changesAtomically);
    } else if (auto load = dyn_cast<memref::LoadOp>(op)) {
      note(arrays[load.getMemRef()], op, /*changes=*/false, /*isAtomic=*/false);
    } else if (auto store = dyn_cast<memref::StoreOp>(op)) {
      // What is stored before anything is read later is there by then.
      Uses &uses = arrays[store.getMemRef()];
      bool isKnown = uses.deferred;
      bool isLater = note(uses, op, /*changes=*/false, /*isAtomic=*/false);
      uses.changed |= isLater || isKnown;
    }
  });
  auto isInOrder = [](const auto &entry) { return entry.second.isInOrder(); };
  return llvm::all_of(states, isInOrder) && llvm::all_of(arrays, isInOrder);
}

/// One group of all: in the innermost block around them that no loop repeats.
static OrderedGroup join(ArrayRef<OrderedGroup> groups) {
  Block *block = groups.front().first->getBlock();
  for (const OrderedGroup &group : groups)
    while (!block->findAncestorOpInBlock(*group.first))
      block = block->getParentOp()->getBlock();
  return {block->findAncestorOpInBlock(*groups.front().first),
          block->findAncestorOpInBlock(*groups.back().last)};
}

SmallVector<OrderedGroup>
IterationLanes::makeGroups(ArrayRef<Operation *> ops) const {
  SmallVector<OrderedGroup> found;
  findGroups(*loop.getBody(), {ops.begin(), ops.end()}, found);
  if (!canDefer(found))
    return {join(found)};
  for (OrderedGroup &group : found)
    group.deferred = true;
  return found;
}

/// What keeps the order of operations: an image, or a writer; null: all of it.
static const void *getResource(Operation *op) {
  if (auto access = dyn_cast<StateAccessOpInterface>(op))
    return access.getAccessedState().getAsOpaquePointer();
  for (Value operand : op->getOperands())
    if (isa<WriterType>(operand.getType()))
      return operand.getAsOpaquePointer();
  return nullptr;
}

/// Whether groups have operations in common.
static bool overlap(const OrderedGroup &a, const OrderedGroup &b) {
  return a.contains(b.first) || a.contains(b.last) || b.contains(a.first) ||
         b.contains(a.last);
}

void IterationLanes::findOrdered() {
  // What shares nothing whose order counts need not stay together.
  struct Cluster {
    SmallVector<Operation *> ops;
    SmallVector<OrderedGroup> groups = {};
  };
  llvm::MapVector<const void *, Cluster> byResource;
  loop.walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (op != loop && !op->hasTrait<OpTrait::IsTerminator>() &&
        getForm(op) == LaneForm::Ordered)
      byResource[getResource(op)].ops.push_back(op);
  });
  SmallVector<Cluster> clusters;
  for (auto &[resource, cluster] : byResource) {
    bool isApart = !byResource.contains(nullptr);
    if (isApart || clusters.empty())
      clusters.emplace_back();
    llvm::append_range(clusters.back().ops, cluster.ops);
  }
  for (Cluster &cluster : clusters)
    cluster.groups = makeGroups(cluster.ops);
  auto collide = [](const Cluster &a, const Cluster &b) {
    return llvm::any_of(a.groups, [&](const OrderedGroup &mine) {
      return llvm::any_of(b.groups, [&](const OrderedGroup &other) {
        return overlap(mine, other);
      });
    });
  };
  for (size_t i = 0; i < clusters.size(); ++i)
    for (size_t j = i + 1; j < clusters.size(); ++j)
      if (collide(clusters[i], clusters[j])) {
        llvm::append_range(clusters[i].ops, clusters[j].ops);
        clusters[i].groups = makeGroups(clusters[i].ops);
        clusters.erase(clusters.begin() + j);
        i = size_t(-1); // What is larger may collide with others.
        break;
      }
  for (const Cluster &cluster : clusters)
    llvm::append_range(groups, cluster.groups);
}

/// Whether all accesses to a row of lanes' elements are one behind the other.
bool IterationLanes::isRow(Operation *op) const {
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
  auto store = dyn_cast<StoreOp>(op);
  return store && isOfRow(store.getIndices());
}

//===----------------------------------------------------------------------===//
// Cost
//===----------------------------------------------------------------------===//

/// What the operations of as many iterations as there are lanes take, in cycles
/// of a processor with vectors of 512 bits (Sapphire Rapids, Zen 4).
namespace cycles {
constexpr double scalar = 5, scalarAccess = 8, scalarDivision = 64;
constexpr double vector = 0.8, row = 1.5, gather = 12, division = 16;
/// To bring lanes apart, for one operation or for a group, and to hand each
/// lane a number.
constexpr double apart = 15, apartInOrder = 40, slot = 8;
constexpr double turns = 8, turnsThatDiffer = 4;
/// Branches that are not foreseen, of a condition that differs, and of a loop
/// whose turns do.
constexpr double branches = 40, exits = 100;
/// To find which lane makes which turn, and to bring there what it has.
constexpr double pairs = 60;
/// How many of the lanes go on, of those that came to a loop whose turns
/// differ; and to one inside of such a loop.
constexpr double goOn = 0.35, goOnInside = 0.7;
} // namespace cycles

namespace {

/// How often code runs, for each time that the loop's lanes do.
struct Frequency {
  double serial = 1, vectors = 1;

  Frequency scaled(double bySerial, double byVectors) const {
    return {serial * bySerial, vectors * byVectors};
  }
};

} // namespace

static int64_t countOperations(Region &region) {
  int64_t count = 0;
  region.walk([&](Operation *) { ++count; });
  return count;
}

/// How often a side of a condition runs, where lanes differ: mostly, if it
/// stands alone; hardly ever, if it does much more than the other, which does
/// something, too.
static Frequency getFrequency(Region &side, Region &other) {
  constexpr int64_t trivial = 16, ratio = 2;
  int64_t count = countOperations(side),
          countOther = other.empty() ? 0 : countOperations(other);
  if (countOther > trivial && count > ratio * countOther)
    return {0.001, 0.016};
  if (countOther <= trivial || countOther > ratio * count)
    return {0.8, 1};
  return {0.5, 1};
}

namespace {

/// Adds up what code takes.
class CostModel {
public:
  explicit CostModel(const IterationLanes &lanes) : lanes(lanes) {}
  void add(Region &region, Frequency times, bool laneByLane);

  IterationLanes::Cost cost;

private:
  void addOperation(Operation *op, Frequency times, bool laneByLane);
  void addBranches(double part, bool laneByLane) {
    cost.serial += part;
    cost.vectors += laneByLane ? part : 0;
  }
  void addStructure(Operation *op, Frequency times, bool laneByLane);

  /// What it takes to bring lanes apart, with what they have.
  void addTurns(const OrderedGroup &group, Frequency times);

  const IterationLanes &lanes;
  llvm::DenseSet<Operation *> turns;
};

} // namespace

void CostModel::add(Region &region, Frequency times, bool laneByLane) {
  for (Operation &op : region.front().without_terminator()) {
    if (isa<NextOp>(op))
      continue; // mostly has nothing to do
    const OrderedGroup *group = laneByLane ? nullptr : lanes.findGroup(&op);
    if (group && group->first == &op)
      addTurns(*group, times);
    bool isApart = laneByLane || turns.contains(&op);
    if (isStructure(&op))
      addStructure(&op, times, isApart);
    else
      addOperation(&op, times, isApart);
  }
}

void CostModel::addTurns(const OrderedGroup &group, Frequency times) {
  llvm::SetVector<Operation *> ops = lanes.findTurns(group);
  turns.insert(ops.begin(), ops.end());
  llvm::DenseSet<Value> inputs;
  for (Operation *op : ops)
    op->walk([&](Operation *inner) {
      for (Value operand : inner->getOperands())
        if (isLaneType(operand.getType()) && lanes.isVarying(operand) &&
            (!operand.getDefiningOp() ||
             !ops.contains(group.first->getBlock()->findAncestorOpInBlock(
                 *operand.getDefiningOp()))))
          inputs.insert(operand);
    });
  cost.vectors += cycles::apartInOrder * times.vectors +
                  cycles::slot * times.serial * inputs.size();
}

void CostModel::addStructure(Operation *op, Frequency times, bool laneByLane) {
  if (auto choice = dyn_cast<scf::IfOp>(op)) {
    Region &yes = choice.getThenRegion(), &no = choice.getElseRegion();
    auto addSide = [&](Region &side, Region &other) {
      if (side.empty())
        return;
      Frequency share = getFrequency(side, other);
      if (!lanes.isVarying(choice.getCondition()))
        share.vectors = share.serial;
      add(side, times.scaled(share.serial, share.vectors), laneByLane);
    };
    addSide(yes, no);
    addSide(no, yes);
    bool isShort = lanes.isCheap(yes) && (no.empty() || lanes.isCheap(no));
    if (lanes.isVarying(choice.getCondition()) && !isShort)
      addBranches(cycles::branches * times.serial, laneByLane);
    return;
  }
  if (auto choice = dyn_cast<scf::IndexSwitchOp>(op)) {
    double share = 1.0 / choice->getNumRegions();
    double shared = lanes.isVarying(choice.getArg()) ? 1 : share;
    for (Region &region : choice->getRegions())
      add(region, times.scaled(share, shared), laneByLane);
    return;
  }
  bool isInside = false;
  for (Operation *at = op->getParentOp(); at != lanes.getLoop();
       at = at->getParentOp())
    isInside |= isa<scf::ForOp, scf::WhileOp>(at) && !lanes.isSharedLoop(at);
  double going = lanes.isSharedLoop(op) ? 1
                 : isInside             ? cycles::goOnInside
                                        : cycles::goOn;
  if (!lanes.isSharedLoop(op))
    addBranches(cycles::exits * times.serial, laneByLane);
  auto loop = dyn_cast<scf::ForOp>(op);
  if (!laneByLane && loop && !lanes.getNest(loop).empty()) {
    Frequency full;
    for (size_t i = 0, e = lanes.getNest(loop).size(); i < e; ++i)
      full.serial *= cycles::turnsThatDiffer *
                     (i == 0 ? cycles::goOn : cycles::goOnInside);
    cost.vectors += cycles::pairs * times.vectors * full.serial;
    add(lanes.getNest(loop).back().getRegion(),
        times.scaled(full.serial, full.serial), laneByLane);
    return;
  }
  double turns =
      lanes.isSharedLoop(op) ? cycles::turns : cycles::turnsThatDiffer;
  for (Region &region : op->getRegions())
    add(region, times.scaled(turns * going, turns), laneByLane);
}

void CostModel::addOperation(Operation *op, Frequency times, bool laneByLane) {
  if (isPrefetch(op) || isa<FailOp, FailListOp, FailDivideOp>(op))
    return; // free, or rare
  LaneForm form = lanes.getForm(op);
  if (form == LaneForm::Uniform || form == LaneForm::Private ||
      form == LaneForm::Lazy)
    return; // as much for one as for all, or nothing
  bool isAccess = form == LaneForm::Access;
  bool isDivided = isDivision(op);
  double serial = times.serial * (isDivided  ? cycles::scalarDivision
                                  : isAccess ? cycles::scalarAccess
                                             : cycles::scalar);
  bool isTurns = form == LaneForm::Serial || form == LaneForm::Ordered;
  bool isGather = isAccess && !lanes.isRow(op);
  double vectors = times.vectors * (isGather    ? cycles::gather
                                    : isAccess  ? cycles::row
                                    : isDivided ? cycles::division
                                                : cycles::vector);
  if (laneByLane || isTurns)
    vectors = serial + (laneByLane ? 0 : times.vectors * cycles::apart);
  else
    cost.computes |= !isAccess;
  cost.serial += serial;
  cost.vectors += vectors;
  if (isTurns || isGather)
    cost.obstacles.emplace(vectors, op);
}

IterationLanes::Cost IterationLanes::getCost() const {
  CostModel model(*this);
  model.add(loop.getRegion(), {}, /*laneByLane=*/false);
  return model.cost;
}
