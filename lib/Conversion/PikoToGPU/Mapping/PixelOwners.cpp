// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Finds, for a dimension and each update,
//   1. the value that the coordinate is, and where it is first known;
//   2. if that is a loop that counts through the coordinate, and all that the
//      loop does is done with its pixel: the loop;
//   3. otherwise the update and what depends on its outcome.
// What has no effect is computed by all threads alike, so that each of them
// finds for its own pixels what a single one would find.

#include "PikoToGPU/Mapping/PixelOwners.h"

#include "PikoToGPU/Mapping/PixelNest.h"

#include "mlir/Dialect/Utils/StaticValueUtils.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

ThreadTile::ThreadTile(int64_t threads, int64_t rank) : extents(rank, 1) {
  for (int64_t dim = 0; threads > 1; threads /= 2, dim = (dim + 1) % rank)
    extents[dim] *= 2;
}

namespace {

class OwnerFinder {
public:
  OwnerFinder(Operation *items, int64_t dim, const llvm::DenseSet<Value> &taken)
      : items(items), body(&items->getRegion(0).front()), dim(dim),
        taken(taken) {}
  OwnedWorks run();

private:
  Value rootOf(UpdateOp update) const {
    return getCoordinateRoot(update.getCoordinates()[dim]);
  }
  bool share(UpdateOp update);
  bool canStride(const PixelLoop &loop) const;
  bool guardIn(Block *block, UpdateOp update, Value root);
  bool guard(UpdateOp update, Value root);
  /// `first` and all after it in its block that depends on it.
  bool collectDependents(UpdateOp update, Operation *first,
                         llvm::SetVector<Operation *> &group);
  bool checkGroup(Value root, const llvm::SetVector<Operation *> &group);
  bool checkBetween(ArrayRef<Operation *> group);
  bool checkEffects();
  bool refuse(Operation *op, StringRef why) {
    found.obstacle = {op->getLoc(), why.str()};
    return false;
  }

  Operation *items;
  Block *body;
  int64_t dim;
  const llvm::DenseSet<Value> &taken;
  OwnedWorks found;
};

} // namespace

/// The array that an operation writes, if it writes one.
static memref::AllocaOp getWrittenArray(Operation *op) {
  auto store = dyn_cast<memref::StoreOp>(op);
  return store ? store.getMemRef().getDefiningOp<memref::AllocaOp>()
               : memref::AllocaOp();
}

static bool isFreeOfEffects(Operation *op) {
  return isMemoryEffectFree(op) || hasSingleEffect<MemoryEffects::Read>(op);
}

OwnedWorks OwnerFinder::run() {
  SmallVector<UpdateOp> updates;
  items->walk([&](UpdateOp update) { updates.push_back(update); });
  if (llvm::all_of(updates, [&](UpdateOp update) { return share(update); }))
    checkEffects();
  return found;
}

bool OwnerFinder::share(UpdateOp update) {
  Value root = rootOf(update);
  for (const OwnedWork &work : found.works)
    if (work.root == root && work.includes(update))
      return true;
  if (auto argument = dyn_cast<BlockArgument>(root)) {
    Operation *owner = argument.getOwner()->getParentOp();
    for (const PixelLoop &loop : getPixelLoops(owner))
      if (loop.getCounter() == root && items->isProperAncestor(owner) &&
          !taken.contains(root) && canStride(loop)) {
        found.works.push_back({root, owner, {}});
        return true;
      }
  }
  return guard(update, root);
}

bool OwnerFinder::canStride(const PixelLoop &loop) const {
  if (auto counted = dyn_cast<scf::ForOp>(loop.op))
    if (!isConstantIntValue(counted.getStep(), 1) || counted.getNumResults() ||
        counted.getUnsignedCmp())
      return false;
  auto isOfPixel = [&](Operation *op) {
    if (auto update = dyn_cast<UpdateOp>(op))
      return rootOf(update) == loop.getCounter();
    if (auto array = getWrittenArray(op))
      return loop.op->isProperAncestor(array);
    return isa<StoreOp, AtomicOp, memref::AllocaOp>(op) ||
           hasEffectsOfRegions(op) || isFreeOfEffects(op);
  };
  WalkResult result = loop.op->getRegion(0).walk([&](Operation *op) {
    return isOfPixel(op) ? WalkResult::advance() : WalkResult::interrupt();
  });
  return !result.wasInterrupted();
}

bool OwnerFinder::collectDependents(UpdateOp update, Operation *first,
                                    llvm::SetVector<Operation *> &group) {
  Block *block = first->getBlock();
  SmallVector<Operation *> todo{first};
  while (!todo.empty()) {
    Operation *op = todo.pop_back_val();
    if (!group.insert(op))
      continue;
    for (Operation *user : op->getUsers()) {
      Operation *dependent = block->findAncestorOpInBlock(*user);
      if (dependent->hasTrait<OpTrait::IsTerminator>())
        return refuse(update, "the outcome of an update decides about other "
                              "pixels");
      todo.push_back(dependent);
    }
  }
  return true;
}

bool OwnerFinder::checkGroup(Value root,
                             const llvm::SetVector<Operation *> &group) {
  for (Operation *member : group) {
    WalkResult result = member->walk([&](Operation *op) -> WalkResult {
      auto other = dyn_cast<UpdateOp>(op);
      if (other && rootOf(other) != root)
        refuse(other, "an update follows from that of another pixel");
      else if (memref::AllocaOp array = getWrittenArray(op);
               array && !member->isAncestor(array))
        refuse(op, "an array outlives the pixel that it is written for");
      return WalkResult(success(!found.obstacle));
    });
    if (result.wasInterrupted())
      return false;
  }
  return true;
}

/// What stands between the operations of a group comes before them then, so it
/// must not mind.
bool OwnerFinder::checkBetween(ArrayRef<Operation *> group) {
  llvm::DenseSet<Operation *> members(group.begin(), group.end());
  for (Operation *op = group.front(); op != group.back();
       op = op->getNextNode())
    if (!members.contains(op) && !isFreeOfEffects(op))
      return refuse(op, "what stands between an update and what follows from "
                        "it has an effect");
  return true;
}

/// What follows from an update in a block, if one thread can do that alone.
bool OwnerFinder::guardIn(Block *block, UpdateOp update, Value root) {
  llvm::SetVector<Operation *> group;
  if (!collectDependents(update, block->findAncestorOpInBlock(*update),
                         group) ||
      !checkGroup(root, group))
    return false;
  SmallVector<Operation *> ordered = group.takeVector();
  llvm::sort(ordered,
             [](Operation *a, Operation *b) { return a->isBeforeInBlock(b); });
  if (!checkBetween(ordered))
    return false;
  found.works.push_back({root, nullptr, ordered});
  return true;
}

/// In the block in which the pixel is known, so that all that is done for it is
/// together; or else farther inside, as a pixel that is the same for all
/// iterations of a loop may be known before it.
bool OwnerFinder::guard(UpdateOp update, Value root) {
  Block *known = root.getParentBlock();
  if (!items->isProperAncestor(known->getParentOp()) && known != body)
    known = body;
  SmallVector<Block *> blocks{update->getBlock()};
  while (blocks.back() != known)
    blocks.push_back(blocks.back()->getParentOp()->getBlock());
  for (Block *block : llvm::reverse(blocks)) {
    found.obstacle.reset();
    if (guardIn(block, update, root))
      return true;
  }
  return false;
}

/// All that has an effect must be done by one thread.
bool OwnerFinder::checkEffects() {
  WalkResult result = items->walk([&](Operation *op) -> WalkResult {
    auto access = dyn_cast<StateAccessOpInterface>(op);
    if (!access || access.getAccessKinds() == StateAccess::reads ||
        llvm::any_of(found.works,
                     [&](const OwnedWork &work) { return work.includes(op); }))
      return WalkResult::advance();
    refuse(op, "what is written does not follow from the update of a pixel");
    return WalkResult::interrupt();
  });
  return !result.wasInterrupted();
}

OwnedWorks piko::findOwnedWorks(Operation *items, int64_t dim,
                                const llvm::DenseSet<Value> &taken) {
  return OwnerFinder(items, dim, taken).run();
}

std::optional<Obstacle> piko::findObstacleToSharing(Operation *items,
                                                    const ThreadTile &tile) {
  llvm::DenseSet<Value> taken;
  for (int64_t dim = 0, e = tile.extents.size(); dim < e; ++dim) {
    if (tile.extents[dim] == 1)
      continue; // Each thread has all pixels of this dimension.
    OwnedWorks found = findOwnedWorks(items, dim, taken);
    if (found.obstacle)
      return found.obstacle;
    for (const OwnedWork &work : found.works)
      if (work.loop)
        taken.insert(work.root);
  }
  return std::nullopt;
}
