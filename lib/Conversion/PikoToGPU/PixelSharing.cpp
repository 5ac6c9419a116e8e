// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Shares the pixels of a bin among the threads of a block. For each dimension
// and each update,
//   1. find the value that the coordinate is, and where it is first known;
//   2. if that is a loop that counts through the coordinate, and all that the
//      loop does is done with its pixel, let it step from one of the thread's
//      own pixels to the next;
//   3. otherwise put the update and what depends on its outcome behind a test.
// What has no effect is computed by all threads alike, so that each of them
// finds for its own pixels what a single one would find.

#include "PikoToGPU.h"

#include "mlir/Dialect/Utils/StaticValueUtils.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/SetVector.h"
#include "llvm/Support/MathExtras.h"

using namespace mlir;
using namespace piko;

ThreadTile::ThreadTile(int64_t threads, int64_t rank) : extents(rank, 1) {
  for (int64_t dim = 0; threads > 1; threads /= 2, dim = (dim + 1) % rank)
    extents[dim] *= 2;
}

Value piko::getCoordinateRoot(Value coordinate) {
  while (Operation *op = coordinate.getDefiningOp()) {
    if (!isa<arith::IndexCastOp, arith::ExtSIOp, arith::TruncIOp>(op))
      break;
    coordinate = op->getOperand(0);
  }
  return coordinate;
}

namespace {

class PixelSharing {
public:
  PixelSharing(scf::ForOp items, const ThreadTile &tile, int64_t dim)
      : items(items), tile(tile), dim(dim), mask(tile.extents[dim] - 1) {}

  LogicalResult run();

private:
  /// A region that a thread enters for its own pixels only.
  struct Owned {
    Operation *op;
    Value root; ///< The coordinate that it is about.
  };

  Value rootOf(UpdateOp update) {
    return getCoordinateRoot(update.getCoordinates()[dim]);
  }
  LogicalResult share(UpdateOp update);
  bool canStride(scf::ForOp loop);
  void stride(scf::ForOp loop);
  LogicalResult guard(UpdateOp update, Value root);
  /// `first` and all behind it in its block that depends on it.
  LogicalResult collectDependents(UpdateOp update, Operation *first,
                                  llvm::SetVector<Operation *> &group);
  LogicalResult checkGroup(UpdateOp update, Value root,
                           const llvm::SetVector<Operation *> &group);
  LogicalResult checkEffects();

  /// A constant, or the thread's place in the tile, of an integer type.
  static Value constant(OpBuilder &builder, Location loc, Type type,
                        int64_t value) {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getIntegerAttr(type, value));
  }
  Value place(OpBuilder &builder, Location loc, Type type) {
    Value index = tile.place[dim];
    return type.isIndex()
               ? index
               : Value(arith::IndexCastOp::create(builder, loc, type, index));
  }

  scf::ForOp items;
  const ThreadTile &tile;
  int64_t dim, mask;
  SmallVector<Owned> owned;
};

} // namespace

/// The array that an operation writes, if it writes one.
static memref::AllocaOp getWrittenArray(Operation *op) {
  auto store = dyn_cast<memref::StoreOp>(op);
  return store ? store.getMemRef().getDefiningOp<memref::AllocaOp>()
               : memref::AllocaOp();
}

LogicalResult PixelSharing::run() {
  if (mask == 0)
    return success(); // Each thread has all pixels of this dimension.
  SmallVector<UpdateOp> updates;
  items.walk([&](UpdateOp update) { updates.push_back(update); });
  for (UpdateOp update : updates)
    if (failed(share(update)))
      return failure();
  return checkEffects();
}

LogicalResult PixelSharing::share(UpdateOp update) {
  Value root = rootOf(update);
  for (const Owned &region : owned)
    if (region.root == root && region.op->isProperAncestor(update))
      return success();
  if (auto argument = dyn_cast<BlockArgument>(root))
    if (auto loop = dyn_cast<scf::ForOp>(argument.getOwner()->getParentOp());
        loop && items->isProperAncestor(loop) && canStride(loop)) {
      stride(loop);
      return success();
    }
  return guard(update, root);
}

bool PixelSharing::canStride(scf::ForOp loop) {
  if (!isConstantIntValue(loop.getStep(), 1) || loop.getNumResults() ||
      loop.getUnsignedCmp())
    return false;
  WalkResult result = loop.getBody()->walk([&](Operation *op) {
    bool fine = true;
    if (auto update = dyn_cast<UpdateOp>(op))
      fine = rootOf(update) == loop.getInductionVar();
    else if (auto array = getWrittenArray(op))
      fine = loop->isProperAncestor(array);
    else if (!isa<StoreOp, AtomicOp>(op))
      fine = op->hasTrait<OpTrait::HasRecursiveMemoryEffects>() ||
             isMemoryEffectFree(op) ||
             hasSingleEffect<MemoryEffects::Read>(op) ||
             isa<memref::AllocaOp>(op);
    return fine ? WalkResult::advance() : WalkResult::interrupt();
  });
  return !result.wasInterrupted();
}

/// Counts how often the loop comes to a pixel of the thread, and makes it a
/// loop over that count: the bounds may be any numbers, and a step of more than
/// one could miss the end and wrap. The count has the type of the bounds, which
/// may take half the registers of an index.
void PixelSharing::stride(scf::ForOp loop) {
  OpBuilder builder(loop);
  Location loc = loop.getLoc();
  Value lo = loop.getLowerBound(), hi = loop.getUpperBound();
  Type type = lo.getType();
  auto number = [&](int64_t value) {
    return constant(builder, loc, type, value);
  };
  auto compare = [&](arith::CmpIPredicate predicate, Value a, Value b) {
    return arith::CmpIOp::create(builder, loc, predicate, a, b);
  };
  Value first = arith::AndIOp::create(
      builder, loc,
      arith::SubIOp::create(builder, loc, place(builder, loc, type), lo),
      number(mask));
  Value distance = arith::SubIOp::create(builder, loc, hi, lo);
  Value any = arith::AndIOp::create(
      builder, loc, compare(arith::CmpIPredicate::slt, lo, hi),
      compare(arith::CmpIPredicate::ult, first, distance));
  Value rest = arith::SubIOp::create(builder, loc, distance, first);
  rest = arith::SubIOp::create(builder, loc, rest, number(1));
  Value count = arith::ShRUIOp::create(builder, loc, rest,
                                       number(llvm::Log2_64(mask + 1)));
  count = arith::AddIOp::create(builder, loc, count, number(1));
  count = arith::SelectOp::create(builder, loc, any, count, number(0));
  first = arith::AddIOp::create(builder, loc, lo, first);

  auto steps = scf::ForOp::create(builder, loc, number(0), count, number(1));
  steps.setUnsignedCmp(true);
  builder.setInsertionPointToStart(steps.getBody());
  Value offset = arith::MulIOp::create(builder, loc, steps.getInductionVar(),
                                       number(mask + 1));
  Value at = arith::AddIOp::create(builder, loc, first, offset);
  loop.getInductionVar().replaceAllUsesWith(at);
  loop.getBody()->getTerminator()->erase();
  steps.getBody()->getOperations().splice(
      steps.getBody()->getTerminator()->getIterator(),
      loop.getBody()->getOperations());
  loop.erase();
  owned.push_back({steps, at});
}

LogicalResult
PixelSharing::collectDependents(UpdateOp update, Operation *first,
                                llvm::SetVector<Operation *> &group) {
  Block *block = first->getBlock();
  SmallVector<Operation *> todo{first};
  while (!todo.empty()) {
    Operation *op = todo.pop_back_val();
    if (!group.insert(op))
      continue;
    for (Operation *user : op->getUsers()) {
      Operation *dependent = block->findAncestorOpInBlock(*user);
      if (dependent->hasTrait<OpTrait::IsTerminator>()) {
        InFlightDiagnostic error = update.emitError(
            "the outcome of an update decides about other pixels");
        error.attachNote(dependent->getLoc()) << "it is needed here";
        return error;
      }
      todo.push_back(dependent);
    }
  }
  return success();
}

LogicalResult
PixelSharing::checkGroup(UpdateOp update, Value root,
                         const llvm::SetVector<Operation *> &group) {
  for (Operation *member : group) {
    WalkResult result = member->walk([&](Operation *op) -> WalkResult {
      auto other = dyn_cast<UpdateOp>(op);
      if (other && rootOf(other) != root) {
        InFlightDiagnostic error =
            other.emitError("an update follows from that of another pixel");
        error.attachNote(update.getLoc()) << "the other update";
        return error;
      }
      memref::AllocaOp array = getWrittenArray(op);
      if (array && !member->isAncestor(array))
        return op->emitError("an array outlives the pixel that it is written "
                             "for");
      return WalkResult::advance();
    });
    if (result.wasInterrupted())
      return failure();
  }
  return success();
}

LogicalResult PixelSharing::guard(UpdateOp update, Value root) {
  Block *known = root.getParentBlock();
  if (!items->isProperAncestor(known->getParentOp()) &&
      known != items.getBody())
    known = items.getBody();
  Operation *first = known->findAncestorOpInBlock(*update);
  llvm::SetVector<Operation *> group;
  if (failed(collectDependents(update, first, group)) ||
      failed(checkGroup(update, root, group)))
    return failure();
  SmallVector<Operation *> ordered(group.begin(), group.end());
  llvm::sort(ordered,
             [](Operation *a, Operation *b) { return a->isBeforeInBlock(b); });
  // What stands between comes first now, so it must not mind.
  for (Operation *op = first; op != ordered.back(); op = op->getNextNode())
    if (!group.contains(op) && !isMemoryEffectFree(op) &&
        !hasSingleEffect<MemoryEffects::Read>(op))
      return op->emitError("what stands between an update and what follows "
                           "from it has an effect");

  OpBuilder builder(ordered.back());
  Location loc = update.getLoc();
  Type type = root.getType();
  Value rest = arith::AndIOp::create(builder, loc, root,
                                     constant(builder, loc, type, mask));
  Value mine = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                                     rest, place(builder, loc, type));
  auto ifOp = scf::IfOp::create(builder, loc, mine);
  for (Operation *op : ordered)
    op->moveBefore(ifOp.thenBlock()->getTerminator());
  owned.push_back({ifOp, root});
  return success();
}

/// All that has an effect must be done by one thread.
LogicalResult PixelSharing::checkEffects() {
  WalkResult result = items.walk([&](Operation *op) -> WalkResult {
    auto access = dyn_cast<StateAccessOpInterface>(op);
    if (!access || access.getAccessKinds() == StateAccess::reads ||
        llvm::any_of(owned, [&](const Owned &region) {
          return region.op->isProperAncestor(op);
        }))
      return WalkResult::advance();
    return op->emitError("what is written does not follow from the update of a "
                         "pixel");
  });
  return failure(result.wasInterrupted());
}

LogicalResult piko::sharePixels(scf::ForOp items, const ThreadTile &tile) {
  for (int64_t dim = 0, e = tile.extents.size(); dim < e; ++dim)
    if (failed(PixelSharing(items, tile, dim).run()))
      return failure();
  return success();
}
