// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Vectorize/Cost/BranchFrequency.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Analysis/Expectations.h"
#include "Vectorize/Analysis/IterationLanes.h"

#include "mlir/Interfaces/LoopLikeInterface.h"

using namespace mlir;
using namespace piko;

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

Frequency piko::getFrequency(Region &side, Region &other, int64_t laneCount) {
  Frequency rare{expected::rareSide, expected::rareSide * double(laneCount)};
  if (isFallbackOf(side, other))
    return rare;
  if (!other.empty() && isFallbackOf(other, side))
    return {1, 1};
  if (isMuchLonger(side, other))
    return rare;
  bool isUsual =
      doesNextToNothing(other) ||
      countOperations(other) > expected::rareToUsual * countOperations(side);
  return {isUsual ? expected::loneSide : expected::eitherSide, 1};
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
    if (after > expected::fewOperations)
      return true;
  }
  return false;
}

bool piko::mayBeSlowPath(scf::IfOp choice, Region &side, Operation *loop) {
  Region &other = getOtherSide(choice, side);
  return hasLoop(side) && !other.empty() && doesNextToNothing(other) &&
         goesOnAfter(choice, loop);
}
