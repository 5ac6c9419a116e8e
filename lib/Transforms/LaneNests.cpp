// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "LaneNests.h"

#include "FlattenLoops.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

using namespace mlir;
using namespace piko;

static bool holds(Operation *loop, llvm::function_ref<bool(Operation *)> isIt) {
  return loop
      ->walk([&](Operation *op) {
        return isIt(op) ? WalkResult::interrupt() : WalkResult::advance();
      })
      .wasInterrupted();
}

/// Whether a loop does anything that lanes do in an order that shows.
static bool isOrdered(Operation *loop, const IterationLanes &lanes) {
  return holds(loop, [&](Operation *op) { return lanes.findGroup(op); });
}

/// Whether all that a loop does is each lane's own, at any time.
static bool isFree(Operation *loop, const IterationLanes &lanes) {
  return !isOrdered(loop, lanes) && !holds(loop, [&](Operation *op) {
    auto counted = dyn_cast<scf::ForOp>(op);
    return isBarrier(op) || isa<memref::AllocaOp>(op) ||
           (counted && !lanes.getNest(counted).empty());
  });
}

/// Whether lanes may leave a loop at different times.
static bool isDivergent(Operation *loop, const IterationLanes &lanes) {
  auto counted = dyn_cast<scf::ForOp>(loop);
  return !lanes.isSharedLoop(loop) && !(counted && getConstantTurns(counted));
}

/// The nests of an iteration whose inner loop lanes leave at different times,
/// from the innermost; all but the first `skipped`.
static FlatNest findNest(const IterationLanes &lanes, size_t skipped) {
  FlatNest found;
  scf::ForOp root = lanes.getLoop();
  root.walk([&](Operation *op) {
    FlatNest nest = op != root ? findFlatNest(op) : FlatNest();
    if (!nest || !isDivergent(nest.inner, lanes) || !isFree(op, lanes))
      return WalkResult::advance();
    if (skipped > 0) {
      --skipped;
      return WalkResult::advance();
    }
    found = nest;
    return WalkResult::interrupt();
  });
  return found;
}

/// What is the same in all turns is no part of their state.
static void hoistInvariants(Operation *loop, const IterationLanes &lanes) {
  for (Region &region : loop->getRegions())
    for (LoadOp load : llvm::make_early_inc_range(region.getOps<LoadOp>()))
      if (load.getIndices().empty() && load.getElements().empty() &&
          lanes.readsFixed(load))
        load->moveBefore(loop);
  moveLoopInvariantCode(cast<LoopLikeOpInterface>(loop));
}

/// Nests that lanes go through one after the other, because an order shows.
static SmallVector<Location> findOrdered(const IterationLanes &lanes) {
  SmallVector<Location> found;
  scf::ForOp root = lanes.getLoop();
  root.walk([&](Operation *op) {
    FlatNest nest = op != root ? findFlatNest(op) : FlatNest();
    if (nest && isDivergent(nest.inner, lanes) && isOrdered(op, lanes))
      found.push_back(op->getLoc());
  });
  return found;
}

FlatLoop piko::flattenNests(const IterationLanes &lanes) {
  constexpr size_t most = 3;
  constexpr double gain = 0.8; // Turns are estimated.
  FlatLoop best{{}, lanes.getCost(), {}, findOrdered(lanes)};
  for (size_t skipped = 0; skipped < most;) {
    scf::ForOp from = best.loop ? best.loop : lanes.getLoop();
    auto loop = cast<scf::ForOp>(OpBuilder(from).clone(*from));
    IterationLanes before(loop, lanes.getLaneCount());
    FlatNest nest = findNest(before, skipped);
    if (!nest) {
      loop.erase();
      break;
    }
    Location loc = nest.outer->getLoc();
    double turns = before.getFlatTurns(nest.outer, nest.inner);
    hoistInvariants(nest.outer, before);
    scf::WhileOp made = flatten(findFlatNest(nest.outer));
    made->setAttr(marks::turns,
                  FloatAttr::get(Float64Type::get(loop.getContext()), turns));
    IterationLanes after(loop, lanes.getLaneCount());
    IterationLanes::Cost cost = after.getCost();
    // A loop that is made of two is not known to stream.
    double lines = std::max(cost.lines, best.cost.lines);
    cost.vectors += lines - cost.lines;
    cost.lines = lines;
    if (after.getRefusal().at || cost.vectors > gain * best.cost.vectors) {
      loop.erase();
      ++skipped;
      continue;
    }
    if (best.loop)
      best.loop.erase();
    cost.serial = best.cost.serial;
    best.loop = loop;
    best.cost = std::move(cost);
    best.nests.push_back(loc);
  }
  return best;
}
