// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Vectorize/Cost/BranchFrequency.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Vectorize/Analysis/IterationLanes.h"

#include "mlir/Interfaces/LoopLikeInterface.h"

using namespace mlir;
using namespace piko;

/// Operations of a side that does next to nothing.
static constexpr int64_t trivial = 16;

bool piko::fails(Region &region) {
  return !region.empty() && llvm::any_of(region.front(), [](Operation &op) {
    return op.hasTrait<Failure>();
  });
}

static bool mayFail(Region &region) {
  return region
      .walk([](Operation *op) {
        return op->hasTrait<Failure>() ? WalkResult::interrupt()
                                       : WalkResult::advance();
      })
      .wasInterrupted();
}

static bool hasLoop(Region &region) {
  return region
      .walk([](LoopLikeOpInterface) { return WalkResult::interrupt(); })
      .wasInterrupted();
}

static bool isFallbackOf(Region &side, Region &other) {
  return !other.empty() && hasLoop(side) && hasLoop(other) && mayFail(side) &&
         !mayFail(other);
}

static Region &getOtherSide(scf::IfOp choice, Region &side) {
  return &side == &choice.getThenRegion() ? choice.getElseRegion()
                                          : choice.getThenRegion();
}

bool piko::isFallback(Region &region) {
  auto choice = dyn_cast<scf::IfOp>(region.getParentOp());
  return choice && isFallbackOf(region, getOtherSide(choice, region));
}

bool piko::doesNextToNothing(Region &side) {
  return side.empty() || countOperations(side) <= trivial;
}

Frequency piko::getFrequency(Region &side, Region &other, int64_t laneCount) {
  constexpr double rare = 0.001;
  if (isFallbackOf(side, other))
    return {rare, rare * double(laneCount)};
  if (!other.empty() && isFallbackOf(other, side))
    return {1, 1};
  constexpr int64_t ratio = 2;
  int64_t count = countOperations(side),
          countOther = other.empty() ? 0 : countOperations(other);
  if (countOther > trivial && count > ratio * countOther)
    return {rare, rare * double(laneCount)};
  if (countOther <= trivial || countOther > ratio * count)
    return {0.8, 1};
  return {0.5, 1};
}

bool piko::isNextGuard(scf::IfOp choice) {
  auto outer = dyn_cast<scf::IfOp>(choice->getParentOp());
  if (!outer || choice->getNextNode() != choice->getBlock()->getTerminator())
    return false;
  return doesNextToNothing(getOtherSide(outer, *choice->getParentRegion()));
}

/// Whether code of a loop goes on after an operation.
static bool goesOnAfter(Operation *op, Operation *loop) {
  for (; op != loop; op = op->getParentOp()) {
    int64_t after = 0;
    for (Operation *at = op->getNextNode(); at; at = at->getNextNode())
      after += countOperations(at);
    if (after > trivial)
      return true;
  }
  return false;
}

bool piko::mayBeSlowPath(scf::IfOp choice, Region &side, Operation *loop) {
  Region &other = getOtherSide(choice, side);
  return hasLoop(side) && !other.empty() && countOperations(other) <= trivial &&
         goesOnAfter(choice, loop);
}
