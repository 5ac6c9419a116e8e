// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// For each update:
//   1. wrap it in a piko.grouped, by its coordinates, with what its body uses
//   of
//      the iteration;
//   2. where that stands in a branch, cut the branch in two around it: the
//   first
//      part yields the coordinates and the rest, and whether they are there.

#include "PikoToGPU/Mapping/GroupUpdates.h"

#include "Piko/Analysis/Uniformity.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Transforms/RegionUtils.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// What can be grouped
//===----------------------------------------------------------------------===//

/// What an update uses of the iteration, besides its coordinates.
static SmallVector<Value> findCaptures(UpdateOp update, Operation *loop) {
  llvm::SetVector<Value> used;
  getUsedValuesDefinedAbove(update->getRegions(), used);
  return llvm::filter_to_vector(used, [&](Value value) {
    return loop->isAncestor(value.getParentBlock()->getParentOp());
  });
}

/// Whether an iteration can leave a value for another thread.
static bool canLeave(Value value) {
  return isa<PrimType>(value.getType()) ||
         value.getType().isIntOrIndexOrFloat();
}

/// The branches that an update stands in and that iterations take each for
/// itself; the innermost first. Null at the end where there is another
/// operation in between.
static SmallVector<scf::IfOp> findBranches(Operation *update, Operation *loop) {
  SmallVector<scf::IfOp> branches;
  for (Operation *at = update->getParentOp(); at != loop && !findBarrier(at);
       at = at->getParentOp())
    branches.push_back(dyn_cast<scf::IfOp>(at));
  return branches;
}

/// What a branch has before an operation and uses after it.
static llvm::SetVector<Value> findCrossing(Operation *middle) {
  llvm::SetVector<Value> crossing;
  for (Operation &op : *middle->getBlock())
    if (op.isBeforeInBlock(middle) && !isa<memref::AllocaOp>(op))
      for (Value result : op.getResults())
        if (llvm::any_of(result.getUsers(), [&](Operation *user) {
              Operation *at = middle->getBlock()->findAncestorOpInBlock(*user);
              return at && middle->isBeforeInBlock(at);
            }))
          crossing.insert(result);
  return crossing;
}

static std::optional<Obstacle> findObstacle(UpdateOp update, Operation *loop) {
  auto cannot = [&](StringRef text) {
    return Obstacle{update.getLoc(), text.str()};
  };
  if (update.getTile() || !update.getBin())
    return cannot("");
  Operation *middle = update;
  for (scf::IfOp branch : findBranches(update, loop)) {
    if (!branch)
      return cannot(middle->getParentOfType<scf::IndexSwitchOp>()
                        ? "the update is in a switch; in branches of if it "
                          "would be shared"
                        : "an iteration updates pixels in a loop of its own; a "
                          "parallel loop over all of its pixels would be "
                          "shared");
    if (!llvm::all_of(findCrossing(middle), canLeave))
      return cannot("what an iteration has before the update and uses after it "
                    "is not numbers or primitives");
    middle = branch;
  }
  if (!llvm::all_of(findCaptures(update, loop), canLeave) ||
      !llvm::all_of(update.getResults(), [](Value result) {
        return result.getType().isIntOrIndexOrFloat();
      }))
    return cannot("the update uses more of its iteration than numbers and "
                  "primitives");
  return std::nullopt;
}

std::optional<Obstacle>
piko::findObstacleToGrouping(ParallelLoopOpInterface loop) {
  llvm::MapVector<Attribute, UpdateOp> updates;
  std::optional<Obstacle> found;
  loop->walk([&](UpdateOp update) {
    if (isa<GroupedOp>(update->getParentOp()))
      return;
    auto [at, isFirst] = updates.insert({update.getImageAttr(), update});
    if (!isFirst)
      found = Obstacle{update.getLoc(),
                       "an iteration has two updates of one image; one update "
                       "would be shared"};
    else if (!found)
      found = findObstacle(update, loop);
  });
  loop->walk([&](StateAccessOpInterface access) {
    if (found || isa<UpdateOp>(*access))
      return;
    if (access.getAccessKinds() & StateAccess::updates)
      found = Obstacle{access.getLoc(), ""};
    else if (updates.contains(access.getAccessedState()))
      found = Obstacle{access.getLoc(),
                       "iterations update this image, and access it in other "
                       "ways, too"};
  });
  return found;
}

//===----------------------------------------------------------------------===//
// Grouping
//===----------------------------------------------------------------------===//

static GroupedOp wrap(UpdateOp update, Operation *loop) {
  OpBuilder builder(update);
  Location loc = update.getLoc();
  Value always =
      arith::ConstantOp::create(builder, loc, builder.getBoolAttr(true));
  SmallVector<Value> captures = findCaptures(update, loop);
  auto grouped = GroupedOp::create(builder, loc, update.getResultTypes(),
                                   always, update.getCoordinates(), captures);
  Block &body = grouped.getBody().emplaceBlock();
  SmallVector<Value> operands(update.getCoordinates());
  llvm::append_range(operands, captures);
  for (Value operand : operands)
    body.addArgument(operand.getType(), loc);
  update->replaceAllUsesWith(grouped);
  update->moveBefore(&body, body.end());
  size_t coordinates = update.getCoordinates().size();
  update.getCoordinatesMutable().assign(
      ValueRange(body.getArguments()).take_front(coordinates));
  for (auto [value, argument] :
       llvm::zip(captures, body.getArguments().drop_front(coordinates)))
    replaceAllUsesInRegionWith(value, argument, update.getBody());
  builder.setInsertionPointToEnd(&body);
  YieldOp::create(builder, loc, ValueRange(), update.getResults());
  return grouped;
}

static Value createNothing(OpBuilder &builder, Location loc, Type type) {
  if (isa<PrimType>(type))
    return NoItemOp::create(builder, loc, type);
  return arith::ConstantOp::create(builder, loc,
                                   cast<TypedAttr>(builder.getZeroAttr(type)));
}

/// Moves an operation out of the branch that it stands in, with what precedes
/// it there in a branch of its own.
static void moveOut(GroupedOp grouped, Operation *loop) {
  auto branch = cast<scf::IfOp>(grouped->getParentOp());
  Location loc = branch.getLoc();
  bool isThen = grouped->getParentRegion() == &branch.getThenRegion();
  llvm::SetVector<Value> leaving = findCrossing(grouped);
  Block *block = grouped->getBlock();
  for (Value operand : grouped->getOperands())
    if (operand.getParentBlock() == block)
      leaving.insert(operand);
  SmallVector<Operation *> before;
  for (Operation &op : llvm::make_range(block->begin(), grouped->getIterator()))
    before.push_back(&op);

  OpBuilder builder(branch);
  auto first = scf::IfOp::create(
      builder, loc, ValueRange(leaving.getArrayRef()).getTypes(),
      branch.getCondition(), /*withElseRegion=*/true);
  first->setDiscardableAttrs(branch->getDiscardableAttrDictionary());
  Block *own = isThen ? first.thenBlock() : first.elseBlock();
  Block *other = isThen ? first.elseBlock() : first.thenBlock();
  if (leaving.empty()) {
    own->clear();
    other->clear();
  }
  for (Operation *op : before)
    if (isa<memref::AllocaOp>(op)) // an iteration has it to its end
      op->moveBefore(&loop->getRegion(0).front().front());
    else
      op->moveBefore(own, own->end());
  builder.setInsertionPointToEnd(own);
  scf::YieldOp::create(builder, loc, leaving.getArrayRef());
  builder.setInsertionPointToEnd(other);
  SmallVector<Value> nothing = llvm::map_to_vector(leaving, [&](Value value) {
    return createNothing(builder, loc, value.getType());
  });
  scf::YieldOp::create(builder, loc, nothing);
  grouped->moveBefore(branch);
  for (auto [value, result] : llvm::zip(leaving, first.getResults()))
    Value(value).replaceUsesWithIf(result, [&](OpOperand &use) {
      return !first->isProperAncestor(use.getOwner());
    });
}

/// Whether a branch does nothing any more.
static bool isEmpty(scf::IfOp branch) {
  return branch.getNumResults() == 0 &&
         llvm::all_of(branch->getRegions(), [](Region &region) {
           return region.empty() || region.front().without_terminator().empty();
         });
}

void piko::groupUpdates(ParallelLoopOpInterface loop) {
  SmallVector<UpdateOp> updates;
  loop->walk([&](UpdateOp update) {
    if (!isa<GroupedOp>(update->getParentOp()))
      updates.push_back(update);
  });
  for (UpdateOp update : updates) {
    SmallVector<scf::IfOp> branches = findBranches(update, loop);
    GroupedOp grouped = wrap(update, loop);
    for (scf::IfOp branch : branches) {
      moveOut(grouped, loop);
      if (isEmpty(branch))
        branch.erase();
    }
  }
}
