// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What lanes do one after the other, so that it keeps its order: emissions, and
// updates of pixels that lanes may share.
//
// All that one image or one writer is concerned with is a group. It runs lane
// by lane in its place, or, if nothing in the loop waits for it, as several
// groups after all that vectors do. So a depth test, the shading of what has
// passed it, and the update of a color run lane by lane, as vectors, and lane
// by lane.

#include "Vectorize/Analysis/LaneOrder.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "llvm/ADT/MapVector.h"

using namespace mlir;
using namespace piko;

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

const OrderedGroup *LaneOrder::findGroup(Operation *op) const {
  for (const OrderedGroup &group : groups)
    if (group.contains(op))
      return &group;
  return nullptr;
}

/// Whether all that an operation does may be done before others.
bool LaneOrder::isMovable(Operation *op) const {
  WalkResult result = op->walk([&](Operation *inner) {
    LaneForm form = getForm(inner);
    bool isFree = inner->hasTrait<OpTrait::IsTerminator>() ||
                  form == LaneForm::Vector || form == LaneForm::Lazy ||
                  (form == LaneForm::Uniform &&
                   !isa<memref::LoadOp, memref::StoreOp>(inner)) ||
                  form == LaneForm::Structure ||
                  (form == LaneForm::Access && readsFixed(inner)) ||
                  (form == LaneForm::Serial && isMemoryEffectFree(inner));
    return isFree ? WalkResult::advance() : WalkResult::interrupt();
  });
  return !result.wasInterrupted();
}

llvm::SetVector<Operation *>
LaneOrder::findMovable(ArrayRef<Operation *> ops) const {
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
LaneOrder::findTurns(const OrderedGroup &group) const {
  SmallVector<Operation *> ops = group.getOperations();
  llvm::SetVector<Operation *> rest(ops.begin(), ops.end());
  for (Operation *op : findMovable(ops))
    rest.remove(op);
  return rest;
}

void LaneOrder::findGroups(Block &block, const llvm::DenseSet<Operation *> &ops,
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

void LaneOrder::findEmissionGroups(Block &block,
                                   const llvm::DenseSet<Operation *> &ops,
                                   SmallVectorImpl<OrderedGroup> &found) const {
  OrderedGroup group;
  auto end = [&] {
    if (group)
      found.push_back(group);
    group = {};
  };
  for (Operation &op : block.without_terminator()) {
    if (ops.contains(&op)) {
      if (!group)
        group.first = &op;
      group.last = &op;
      continue;
    }
    if (llvm::none_of(ops, [&](Operation *one) { return op.isAncestor(one); }))
      continue;
    end();
    for (Region &region : op.getRegions())
      if (!region.empty())
        findEmissionGroups(region.front(), ops, found);
  }
  end();
}

/// Whether operations emit, and no loop of an iteration repeats them.
bool LaneOrder::areEmissions(ArrayRef<Operation *> ops) const {
  return llvm::all_of(ops, [&](Operation *op) {
    bool isOnce = isa<AppendOp, AppendBinOp, NextOp>(op);
    for (Operation *at = op->getParentOp(); at != loop; at = at->getParentOp())
      isOnce &= isa<scf::IfOp, scf::IndexSwitchOp>(at);
    return isOnce;
  });
}

bool LaneOrder::canDelay(const OrderedGroup &group,
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
  bool inPlace = false, late = false, changed = false;
  /// Whether all uses are changes that commute, all of one kind.
  bool commute = true;
  std::optional<AtomicKind> kind = std::nullopt;

  bool isInOrder() const { return !inPlace || !late || !changed || commute; }
  void addChange(Operation *op) {
    auto atomic = dyn_cast<AtomicOp>(op);
    commute &= atomic && !atomic.getOld() &&
               atomic.getKind() != AtomicKind::AddF &&
               kind.value_or(atomic.getKind()) == atomic.getKind();
    if (atomic)
      kind = atomic.getKind();
  }
};

} // namespace

bool LaneOrder::canDelay(ArrayRef<OrderedGroup> groups) const {
  llvm::DenseSet<Operation *> later;
  for (const OrderedGroup &group : groups) {
    llvm::SetVector<Operation *> rest = findTurns(group);
    if (!canDelay(group, rest))
      return false;
    later.insert(rest.begin(), rest.end());
  }
  llvm::DenseMap<Attribute, Uses> states;
  llvm::DenseMap<Value, Uses> arrays;
  auto note = [&](Uses &uses, Operation *op, bool changes) {
    bool isLater = false;
    for (Operation *at = op; at != loop && !isLater; at = at->getParentOp())
      isLater = later.contains(at);
    (isLater ? uses.late : uses.inPlace) = true;
    uses.changed |= changes;
    uses.addChange(op);
    return isLater;
  };
  loop.walk([&](Operation *op) {
    if (auto access = dyn_cast<StateAccessOpInterface>(op)) {
      note(states[access.getAccessedState()], op,
           access.getAccessKinds() != StateAccess::reads);
    } else if (auto load = dyn_cast<memref::LoadOp>(op)) {
      note(arrays[load.getMemRef()], op, /*changes=*/false);
    } else if (auto store = dyn_cast<memref::StoreOp>(op)) {
      // What is stored before anything is read later is there by then.
      Uses &uses = arrays[store.getMemRef()];
      bool isKnown = uses.late;
      bool isLater = note(uses, op, /*changes=*/false);
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
LaneOrder::makeGroups(ArrayRef<Operation *> ops) const {
  SmallVector<OrderedGroup> found;
  llvm::DenseSet<Operation *> wanted(ops.begin(), ops.end());
  if (areEmissions(ops))
    findEmissionGroups(*loop.getBody(), wanted, found);
  if (found.empty() || !canDelay(found)) {
    found.clear();
    findGroups(*loop.getBody(), wanted, found);
    if (!canDelay(found))
      return {join(found)};
  }
  for (OrderedGroup &group : found)
    group.late = true;
  return found;
}

/// What keeps the order of operations: an image, or a writer; null: all of it.
static const void *getResource(Operation *op) {
  if (auto access = dyn_cast<StateAccessOpInterface>(op))
    return access.getAccessedState().getAsOpaquePointer();
  if (auto store = dyn_cast<memref::StoreOp>(op))
    if (Attribute pixels = getPixels(store))
      return pixels.getAsOpaquePointer();
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

void LaneOrder::findOrdered() {
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

void LaneOrder::findOrder() {
  groups.clear();
  emissions.clear();
  emitted.clear();
  if (getRefusal().at)
    return;
  findOrdered();
  findEmissions();
}
