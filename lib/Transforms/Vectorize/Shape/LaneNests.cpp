// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Nests of an iteration in which lanes would wait for the one that iterates
// most, as over the probes of a hash table in each of eight corners, are
// flattened: each lane goes through the nest by itself (FlattenLoops). A lane
// does what it did, in the order that it did. Nests whose order shows between
// lanes, as they emit or update pixels that lanes may share, stay, and a note
// says so.
//
// Where all that iterations do by themselves is one such loop, as rays that end
// at different times have, the loop over iterations is flattened as well. Lanes
// take iterations that are as many apart as there are lanes, and each goes on
// to its next one by itself. It waits with that until three eighths of the
// lanes do, or no other one has anything to do.
//
// Loops are flattened where that is expected to take a fifth less.
//
// A whole nest, of loops beside others and under conditions, is merged into one
// loop where that is expected to take less still (MergeLoops): what stands
// around the innermost loop is then done when enough lanes are done with that,
// rather than for whoever is done. Not merged are loops under an index switch,
// ranges as the innermost loop, and what holds barriers, arrays of its own, or
// work whose order shows.

#include "Vectorize/Shape/LaneNests.h"

#include "Vectorize/Shape/FlattenLoops.h"
#include "Vectorize/Shape/MergeLoops.h"

#include "Piko/Analysis/Expectations.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
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
  return !lanes.isSharedLoop(loop) &&
         !(counted && getConstantIterations(counted));
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

/// What is the same in all iterations is no part of their state.
static void hoistFromNest(Operation *loop, const IterationLanes &lanes) {
  for (Region &region : loop->getRegions())
    for (LoadOp load : llvm::make_early_inc_range(region.getOps<LoadOp>()))
      if (load.getIndices().empty() && load.getElements().empty() &&
          lanes.readsFixed(load))
        load->moveBefore(loop);
  moveLoopInvariantCode(cast<LoopLikeOpInterface>(loop));
}

/// Takes what is the same for all lanes, and does not change, out of a nest and
/// of the conditions in it.
static void hoistShared(Operation *nest, const IterationLanes &lanes) {
  SmallVector<Operation *> ops;
  nest->walk<WalkOrder::PreOrder>([&](Operation *op) { ops.push_back(op); });
  for (Operation *op : ops) {
    auto load = dyn_cast<LoadOp>(op);
    bool isFixed = load ? load.getIndices().empty() &&
                              load.getElements().empty() &&
                              lanes.readsFixed(load)
                        : op->getNumRegions() == 0 && isPure(op);
    bool isShared =
        isFixed && op != nest && op->getNumResults() > 0 &&
        !op->hasTrait<OpTrait::IsTerminator>() &&
        llvm::none_of(op->getResults(),
                      [&](Value value) { return lanes.isVarying(value); }) &&
        llvm::all_of(op->getOperands(), [&](Value value) {
          return !nest->isAncestor(value.getParentRegion()->getParentOp());
        });
    if (isShared)
      op->moveBefore(nest);
  }
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

/// Takes a loop instead of the best one, if it is expected to take less;
/// otherwise erases it.
static bool tryLoop(FlatLoop &best, scf::ForOp loop, int64_t laneCount,
                    Location nest, double gain) {
  IterationLanes lanes(loop, laneCount);
  IterationLanes::Cost cost = lanes.getCost();
  // A loop that is made of two is not known to stream.
  double lines = std::max(cost.lines, best.cost.lines);
  cost.vectors += lines - cost.lines;
  cost.lines = lines;
  if (lanes.getRefusal().at || cost.vectors > gain * best.cost.vectors) {
    loop.erase();
    return false;
  }
  if (best.loop)
    best.loop.erase();
  cost.serial = best.cost.serial;
  best.loop = loop;
  best.cost = std::move(cost);
  best.nests.push_back(nest);
  return true;
}

/// What flattened loops must take at the most, of what others do: how often
/// they iterate is estimated.
static constexpr double gainOfFlat = 0.8;

static void setIterations(scf::WhileOp loop, double iterations) {
  loop->setAttr(marks::iterations, Builder(loop).getF64FloatAttr(iterations));
}

static scf::ForOp clone(scf::ForOp loop) {
  return cast<scf::ForOp>(OpBuilder(loop).clone(*loop));
}

//===----------------------------------------------------------------------===//
// Iterations
//===----------------------------------------------------------------------===//

/// Whether lanes may go on to their next iterations each by itself: no order
/// shows of what they do, but primitives may be counted by themselves.
static bool mayGoOnAlone(const IterationLanes &lanes) {
  scf::ForOp root = lanes.getLoop();
  return root.getLowerBound().getType().isIndex() &&
         !holds(root, [&](Operation *op) {
           auto counted = dyn_cast<scf::ForOp>(op);
           return (op != root && !isa<NextOp>(op) && lanes.findGroup(op)) ||
                  isBarrier(op) || isPrefetch(op) ||
                  (isa<NextOp>(op) && op->getParentOp() != root) ||
                  (counted && op != root && !lanes.getNest(counted).empty());
         });
}

/// The only loop that stands in an iteration by itself, if lanes leave it at
/// different times.
static Operation *findOwnLoop(const IterationLanes &lanes) {
  scf::ForOp root = lanes.getLoop();
  Operation *own = nullptr;
  for (Operation &op : root.getBody()->without_terminator())
    if (isa<scf::ForOp, scf::WhileOp>(op)) {
      if (own)
        return nullptr;
      own = &op;
    }
  return own && isDivergent(own, lanes) ? own : nullptr;
}

/// Takes out of a loop what counts its primitives.
static SmallVector<Value> takeWriters(scf::ForOp loop) {
  SmallVector<Value> writers;
  for (NextOp next :
       llvm::make_early_inc_range(loop.getBody()->getOps<NextOp>())) {
    writers.push_back(next.getWriter());
    next.erase();
  }
  return writers;
}

/// Makes a loop over the lanes, around one over the iterations of each, as many
/// apart as there are lanes.
static scf::ForOp stripMine(scf::ForOp loop, int64_t laneCount) {
  OpBuilder builder(loop);
  Location loc = loop.getLoc();
  Value lower = loop.getLowerBound(), upper = loop.getUpperBound();
  Value width = arith::ConstantOp::create(
      builder, loc, builder.getIntegerAttr(lower.getType(), laneCount));
  Value after = arith::AddIOp::create(builder, loc, lower, width,
                                      arith::IntegerOverflowFlags::nsw);
  Value end = arith::MinSIOp::create(builder, loc, after, upper);
  auto ofLanes = scf::ForOp::create(builder, loc, lower, end, loop.getStep());
  ofLanes->setAttrs(loop->getAttrs());
  builder.setInsertionPointToStart(ofLanes.getBody());
  Value first = ofLanes.getInductionVar();
  auto own = scf::ForOp::create(builder, loc, first, upper, width);
  loop.getInductionVar().replaceAllUsesWith(own.getInductionVar());
  auto &body = own.getBody()->getOperations();
  body.splice(body.begin(), loop.getBody()->getOperations(),
              loop.getBody()->begin(), std::prev(loop.getBody()->end()));
  // Arrays of one iteration after the other take the same place.
  for (auto array : llvm::to_vector(own.getBody()->getOps<memref::AllocaOp>()))
    array->moveBefore(own);
  loop.erase();
  return ofLanes;
}

/// Reads what is used after a loop before it.
static void readAhead(Operation *loop) {
  for (Operation *op = loop->getNextNode(), *next; op; op = next) {
    next = op->getNextNode();
    auto get = dyn_cast<GetOp>(op);
    if (get && get.getElements().empty() &&
        get.getPrim().getParentBlock() == loop->getBlock() &&
        get.getPrim().getDefiningOp()->isBeforeInBlock(loop))
      get->moveBefore(loop);
  }
}

/// Lanes take iterations that are as many apart as there are lanes, and each
/// goes on to its next one by itself.
static void flattenIterations(FlatLoop &best, const IterationLanes &lanes) {
  int64_t laneCount = lanes.getLaneCount();
  scf::ForOp loop = clone(best.loop ? best.loop : lanes.getLoop());
  IterationLanes before(loop, laneCount);
  Operation *inner = findOwnLoop(before);
  if (!inner || !mayGoOnAlone(before)) {
    loop.erase();
    return;
  }
  constexpr double atOnce = 3.0 / 8;
  double iterations = before.getOwnIterations(inner);
  Location loc = loop.getLoc();
  SmallVector<Value> writers = takeWriters(loop);
  loop = stripMine(loop, laneCount);
  readAhead(inner);
  hoistFromNest(inner->getParentOp(), before);
  FlatNest nest = findFlatNest(inner->getParentOp());
  if (!nest) {
    loop.erase();
    return;
  }
  nest.advances = std::min(1.0, 1 / (iterations * atOnce));
  setIterations(flatten(nest), iterations / expected::fullness);
  if (tryLoop(best, loop, laneCount, loc, gainOfFlat))
    best.writers = writers;
}

void piko::countPrimitives(scf::ForOp loop, ValueRange writers) {
  OpBuilder builder(loop);
  Location loc = loop.getLoc();
  for (Value writer : writers) {
    Value isCounted = IsCountedOp::create(builder, loc, writer);
    auto choice =
        scf::IfOp::create(builder, loc, isCounted, /*withElseRegion=*/false);
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(choice.thenBlock());
    auto made = scf::ForOp::create(builder, loc, loop.getLowerBound(),
                                   loop.getUpperBound(), loop.getStep());
    builder.setInsertionPointToStart(made.getBody());
    NextOp::create(builder, loc, writer);
  }
}

//===----------------------------------------------------------------------===//
// Merged nests
//===----------------------------------------------------------------------===//

/// The nest of an iteration whose innermost loop lanes leave at different
/// times, from the outermost loop; empty if there is none that may be merged.
static SmallVector<NestedLoop> findMergeableNest(const IterationLanes &lanes) {
  SmallVector<NestedLoop> nest;
  auto mayPart = [&](Operation *loop) {
    return holds(loop, [&](Operation *op) {
      return isa<scf::ForOp, scf::WhileOp>(op) && isDivergent(op, lanes);
    });
  };
  for (Operation *at = findMergeable(lanes.getLoop(), mayPart); at;
       at = findMergeable(at, mayPart))
    nest.push_back({at, lanes.getIterations(at)});
  while (!nest.empty() && !isDivergent(nest.back().loop, lanes))
    nest.pop_back();
  // Ranges differ less than what else ends loops, and are short.
  while (!nest.empty() && isa<scf::ForOp>(nest.back().loop))
    nest.pop_back();
  if (nest.size() < 2 || !isFree(nest.front().loop, lanes))
    return {};
  return nest;
}

/// The reads of a loop's primitives, whose fields a state may keep; none if
/// they are used otherwise.
static std::optional<SmallVector<GetOp>> findReads(scf::ForOp loop) {
  SmallVector<GetOp> reads;
  for (Operation &op : *loop.getBody())
    for (Value result : op.getResults())
      if (isa<PrimType>(result.getType()))
        for (Operation *user : result.getUsers()) {
          auto get = dyn_cast<GetOp>(user);
          if (!get || !get.getElements().empty())
            return std::nullopt;
          reads.push_back(get);
        }
  return reads;
}

/// Merges a whole nest into one loop, whatever stands around and beside its
/// loops; with it the loop over iterations, where there is more than a vector
/// of them.
static void mergeNest(FlatLoop &best, const IterationLanes &lanes,
                      double gain) {
  int64_t laneCount = lanes.getLaneCount();
  scf::ForOp loop = clone(lanes.getLoop());
  IterationLanes before(loop, laneCount);
  SmallVector<NestedLoop> nest = findMergeableNest(before);
  if (nest.empty()) {
    loop.erase();
    return;
  }
  hoistShared(loop, before);
  Location loc = nest.front().loop->getLoc();
  SmallVector<Value> writers;
  std::optional<SmallVector<GetOp>> reads = findReads(loop);
  if (!isOneVector(loop, laneCount) && mayGoOnAlone(before) && reads) {
    for (GetOp read : *reads)
      read->moveAfter(read.getPrim().getDefiningOp());
    writers = takeWriters(loop);
    loop = stripMine(loop, laneCount);
    Operation *own = *loop.getBody()->getOps<scf::ForOp>().begin();
    nest.insert(nest.begin(), {own, /*iterations=*/1});
  }
  mergeLoops(nest, loop.getBody());
  if (tryLoop(best, loop, laneCount, loc, gain)) {
    best.writers = writers;
    best.nests = {loc};
    best.isMerged = true;
  }
}

FlatLoop piko::flattenNests(const IterationLanes &lanes, double mergeGain) {
  constexpr size_t most = 3;
  FlatLoop best{{}, lanes.getCost(), {}, findOrdered(lanes)};
  for (size_t skipped = 0; skipped < most;) {
    scf::ForOp loop = clone(best.loop ? best.loop : lanes.getLoop());
    IterationLanes before(loop, lanes.getLaneCount());
    FlatNest nest = findNest(before, skipped);
    if (!nest) {
      loop.erase();
      break;
    }
    Location loc = nest.outer->getLoc();
    double iterations = before.getFlatIterations(nest.outer, nest.inner);
    hoistFromNest(nest.outer, before);
    setIterations(flatten(findFlatNest(nest.outer)), iterations);
    skipped += !tryLoop(best, loop, lanes.getLaneCount(), loc, gainOfFlat);
  }
  flattenIterations(best, lanes);
  if (mergeGain > 0)
    mergeNest(best, lanes, mergeGain);
  return best;
}
