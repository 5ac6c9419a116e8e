// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Finds the pixels of a primitive, from the loop over primitives inwards:
//   1. in each block, the operation that has an effect: a condition or a loop;
//   2. of a condition whose branches both have effects, the one that uses
//      arrays of the phase is the rare one: clipping, a case apart;
//   3. loops over dimensions, whose bounds depend on nothing in them; a
//      coordinate of all updates is the counter of one, or the primitive's;
//   4. below them, tests that are cheap enough to be done twice.

#include "PikoToGPU/Mapping/PixelNest.h"

#include "PikoToGPU/PikoToGPU.h"

#include "mlir/Dialect/Utils/StaticValueUtils.h"
#include "mlir/Interfaces/LoopLikeInterface.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

using namespace mlir;
using namespace piko;

namespace {

class NestFinder {
public:
  NestFinder(Operation *items, StageOp stage)
      : items(items), rank(stage.getBins().size()),
        obstacle{items->getLoc(), ""} {
    for (int64_t extent : stage.getBins())
      if (extent == 0)
        refuse(items, "a bin is the whole domain");
  }
  PixelNestResult run();

private:
  /// Whether it is done; the next block otherwise.
  bool descend(Block *block);
  bool enter(Block *block, scf::IfOp branch);
  bool enter(Block *block, Operation *loop);
  bool usesArraysOutside(Operation *op, Region &region) const;
  bool isCheapTest(Block *block, scf::IfOp test) const;
  bool checkWork();
  bool checkCoordinate(Value coordinate);
  bool checkBounds();
  bool isOfPrimitive(Value value);
  bool refuse(Operation *op, const Twine &why) {
    if (obstacle.text.empty())
      obstacle = {op->getLoc(), why.str()};
    return false;
  }

  Operation *items;
  int64_t rank;
  PixelNest nest;
  Obstacle obstacle;
};

} // namespace

/// Whether something outside of a thread's registers is changed.
static bool hasEffect(Operation *op) {
  return contains(op, [](Operation *inner) {
    if (auto access = dyn_cast<StateAccessOpInterface>(inner))
      return access.getAccessKinds() != StateAccess::reads;
    return isa<memref::StoreOp>(inner) ||
           (!hasEffectsOfRegions(inner) && !isa<memref::AllocaOp>(inner) &&
            !isMemoryEffectFree(inner) &&
            !hasSingleEffect<MemoryEffects::Read>(inner));
  });
}

static bool hasEffect(Region &region) {
  return llvm::any_of(region.getOps(),
                      [](Operation &op) { return hasEffect(&op); });
}

/// Whether a region uses arrays that live outside of `op`.
bool NestFinder::usesArraysOutside(Operation *op, Region &region) const {
  return region
      .walk([&](Operation *inner) {
        for (Value operand : inner->getOperands()) {
          auto array = operand.getDefiningOp<memref::AllocaOp>();
          if (array && !op->isAncestor(array))
            return WalkResult::interrupt();
        }
        return WalkResult::advance();
      })
      .wasInterrupted();
}

/// Whether it costs little to find the outcome again.
bool NestFinder::isCheapTest(Block *block, scf::IfOp test) const {
  if (test.getNumResults() ||
      (test.elseBlock() && hasEffect(test.getElseRegion())))
    return false;
  // A remainder of floats becomes a loop.
  return llvm::all_of(*block, [&](Operation &op) {
    return &op == test || (!op.getNumRegions() && !isa<arith::RemFOp>(op));
  });
}

bool NestFinder::enter(Block *block, scf::IfOp branch) {
  nest.levels.push_back({block, branch});
  Region &then = branch.getThenRegion(), &otherwise = branch.getElseRegion();
  bool hasThen = hasEffect(then), hasElse = hasEffect(otherwise);
  if (!hasThen || !hasElse)
    return descend(hasThen ? &then.front() : &otherwise.front());
  bool isRareThen = usesArraysOutside(branch, then),
       isRareElse = usesArraysOutside(branch, otherwise);
  if (isRareThen == isRareElse)
    return refuse(branch, "primitives have pixels on both ways of a condition, "
                          "and neither is known to be rare by its arrays");
  nest.rare.push_back(isRareThen ? &then.front() : &otherwise.front());
  return descend(isRareThen ? &otherwise.front() : &then.front());
}

SmallVector<PixelLoop, 3> piko::getPixelLoops(Operation *op) {
  SmallVector<PixelLoop, 3> loops;
  if (isa<scf::ForOp, ParallelForOp>(op))
    loops.push_back({op});
  if (auto pixels = dyn_cast<ParallelPixelsOp>(op))
    for (unsigned dim = 0, e = pixels.getCell().size(); dim < e; ++dim)
      loops.push_back({op, dim});
  return loops;
}

Value PixelLoop::getFirst() const {
  if (auto loop = dyn_cast<scf::ForOp>(op))
    return loop.getLowerBound();
  auto pixels = dyn_cast<ParallelPixelsOp>(op);
  return pixels ? pixels.getLo()[dim] : Value();
}

Value PixelLoop::getEnd() const {
  if (auto loop = dyn_cast<scf::ForOp>(op))
    return loop.getUpperBound();
  if (auto pixels = dyn_cast<ParallelPixelsOp>(op))
    return pixels.getHi()[dim];
  return cast<ParallelForOp>(op).getCount();
}

bool NestFinder::enter(Block *block, Operation *op) {
  if (auto loop = dyn_cast<scf::ForOp>(op)) {
    if (!isConstantIntValue(loop.getStep(), 1) || loop.getUnsignedCmp())
      return refuse(loop, "a loop over pixels does not count by one");
    if (loop.getNumResults())
      return refuse(loop, "a value goes from one pixel to the next; compute it "
                          "from the pixel");
  }
  nest.levels.push_back({block, op});
  for (const PixelLoop &loop : getPixelLoops(op)) {
    nest.loops.push_back(loop);
    for (Value bound : {loop.getFirst(), loop.getEnd()})
      if (bound && nest.loops.front().op->isAncestor(
                       bound.getParentBlock()->getParentOp()))
        return refuse(op, "a row's bounds depend on the row");
  }
  return descend(&op->getRegion(0).front());
}

/// Whether a loop counts to a coordinate of an update.
static bool countsPixels(const PixelLoop &loop) {
  return contains(loop.op, [&](Operation *op) {
    auto update = dyn_cast<UpdateOp>(op);
    return update && llvm::any_of(update.getCoordinates(), [&](Value value) {
             return getCoordinateRoot(value) == loop.getCounter();
           });
  });
}

bool NestFinder::descend(Block *block) {
  SmallVector<Operation *> effects;
  for (Operation &op : block->without_terminator())
    if (hasEffect(&op))
      effects.push_back(&op);
  if (effects.empty())
    return refuse(items, "it updates no pixel");
  if (effects.size() == 1) {
    auto loops = getPixelLoops(effects.front());
    if (!loops.empty() && llvm::all_of(loops, countsPixels))
      return enter(block, effects.front());
    auto branch = dyn_cast<scf::IfOp>(effects.front());
    if (branch && nest.loops.empty() && !branch.getNumResults())
      return enter(block, branch);
    if (branch && !nest.loops.empty() && isCheapTest(block, branch)) {
      nest.levels.push_back({block, branch});
      return descend(branch.thenBlock());
    }
  }
  nest.work = block;
  nest.anchor = nest.loops.empty() ? effects.front() : nest.loops.front().op;
  return checkWork();
}

/// Whether a coordinate is the loop's, or else the primitive's.
bool NestFinder::checkCoordinate(Value coordinate) {
  Value root = getCoordinateRoot(coordinate);
  for (const PixelLoop &loop : nest.loops)
    if (root == loop.getCounter())
      return true;
  if (!items->isAncestor(coordinate.getParentBlock()->getParentOp()))
    return true;
  Operation *made = coordinate.getDefiningOp();
  if (!made) // of a loop in the work
    return false;
  auto *level = llvm::find_if(nest.levels, [&](const PixelNest::Level &each) {
    return each.block == made->getBlock();
  });
  if (made->getBlock() == nest.anchor->getBlock())
    return made->isBeforeInBlock(nest.anchor);
  return level != nest.levels.end() && !nest.isInside(made);
}

/// Whether a coordinate of the domain fits.
static bool isWide(Type type) {
  return type.isIndex() || type.getIntOrFloatBitWidth() >= 32;
}

/// Whether a coordinate is its root, and not some bits of it.
static bool isExact(Value coordinate) {
  Value root = getCoordinateRoot(coordinate);
  for (; coordinate != root;
       coordinate = coordinate.getDefiningOp()->getOperand(0))
    if (!isWide(coordinate.getType()))
      return false;
  return isWide(root.getType());
}

/// All updates are of the same pixel, which the loops count to.
bool NestFinder::checkWork() {
  WalkResult result = nest.work->walk([&](UpdateOp update) {
    if (!nest.update)
      nest.update = update;
    auto isSame = [](Value a, Value b) {
      return getCoordinateRoot(a) == getCoordinateRoot(b);
    };
    for (auto [one, other] :
         llvm::zip(nest.update.getCoordinates(), update.getCoordinates()))
      if (!isSame(one, other) ||
          (update == nest.update && !checkCoordinate(one))) {
        refuse(update, "its pixel is not what its loops count to");
        return WalkResult::interrupt();
      }
    if (!llvm::all_of(update.getCoordinates(), isExact)) {
      refuse(update, "a coordinate has less than 32 bits");
      return WalkResult::interrupt();
    }
    return WalkResult::advance();
  });
  if (result.wasInterrupted())
    return false;
  if (!nest.update || !nest.update.getBin())
    return refuse(items, "it updates no pixel");
  for (const PixelLoop &loop : nest.loops)
    if (!countsPixels(loop))
      return refuse(loop.op, "its pixel is not what its loops count to");
  if (usesArraysOutside(nest.anchor, *nest.work->getParent()))
    return refuse(nest.anchor, "its work on pixels uses an array of the phase");
  return checkBounds();
}

/// Whether a value may differ between primitives.
bool NestFinder::isOfPrimitive(Value value) {
  if (!items->isAncestor(value.getParentBlock()->getParentOp()))
    return false;
  Operation *made = value.getDefiningOp();
  return !made || made->getNumRegions() || !isMemoryEffectFree(made) ||
         llvm::any_of(made->getOperands(),
                      [&](Value operand) { return isOfPrimitive(operand); });
}

/// Whether primitives differ in their pixels.
bool NestFinder::checkBounds() {
  bool differs = false;
  for (int64_t dim = 0; dim < rank; ++dim) {
    const PixelLoop *loop = nest.getLoop(dim);
    for (int64_t other = 0; loop && other < dim; ++other)
      if (nest.getLoop(other) == loop)
        return refuse(loop->op, "a loop counts to two coordinates");
    if (Value first = nest.getFirst(dim))
      differs |= isOfPrimitive(first);
    differs |= loop && isOfPrimitive(loop->getEnd());
  }
  return differs || refuse(nest.anchor, "all primitives have the same pixels");
}

const PixelLoop *PixelNest::getLoop(int64_t dim) {
  Value root = getCoordinateRoot(getCoordinate(dim));
  for (const PixelLoop &loop : loops)
    if (loop.getCounter() == root)
      return &loop;
  return nullptr;
}

PixelNestResult NestFinder::run() {
  if (obstacle.text.empty() && descend(&items->getRegion(0).front()))
    return {nest, obstacle};
  return {std::nullopt, obstacle};
}

PixelNestResult piko::findPixelNest(Operation *items, StageOp stage) {
  return NestFinder(items, stage).run();
}

void piko::hoistOutOfPixelLoops(Operation *items) {
  SmallVector<Operation *> loops; // those inside others first
  items->getRegion(0).walk([&](Operation *op) {
    if (isa<LoopLikeOpInterface, ParallelLoopOpInterface>(op) &&
        contains(op, [](Operation *inner) { return isa<UpdateOp>(inner); }))
      loops.push_back(op);
  });
  for (Operation *op : loops) {
    if (auto loop = dyn_cast<LoopLikeOpInterface>(op)) {
      moveLoopInvariantCode(loop);
      continue;
    }
    moveLoopInvariantCode(
        {&op->getRegion(0)},
        [&](Value value, Region *region) {
          return !region->isAncestor(value.getParentRegion());
        },
        [&](Operation *inner, Region *) {
          return isMemoryEffectFree(inner) && isSpeculatable(inner);
        },
        [&](Operation *inner, Region *) { inner->moveBefore(op); });
  }
}
