// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-lockstep: parallel loops whose iterations meet at barriers. Those of up
// to 16 iterations become one vector (IterationBarriers); others are cut into
// loops between barriers, as piko-split-loops cuts them.

#include "Piko/Transforms/Storage/CountedWhiles.h"
#include "Piko/Transforms/Storage/LoopSplitter.h"
#include "Piko/Transforms/Storage/ParallelLoops.h"
#include "Vectorize/Analysis/LaneArrays.h"
#include "Vectorize/LaneCandidate.h"
#include "Vectorize/Write/IterationWriter.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

namespace piko {
#define GEN_PASS_DEF_LOCKSTEP
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

/// Whether the iterations of a loop, which meet, are now lanes of one vector.
static bool runInLockstep(ParallelForOp parallel) {
  constexpr int64_t most = 16;
  std::optional<int64_t> count = getConstantIntValue(parallel.getCount());
  if (!count || *count > most)
    return false;
  auto copy = cast<ParallelForOp>(OpBuilder(parallel).clone(*parallel));
  scf::ForOp loop =
      convertLoop(cast<ParallelLoopOpInterface>(*hoistInvariants(copy)));
  LaneCandidate candidate(loop);
  upliftWhiles(loop);
  readAllElements(loop);
  copyItemArrays(loop);
  int64_t laneCount = std::max<int64_t>(llvm::PowerOf2Ceil(*count), 4);
  IterationLanes lanes(loop, laneCount);
  bool isDone = candidate.isChosen() && candidate.decide(lanes);
  if (isDone) {
    IterationWriter(lanes).write(OpBuilder(loop).saveInsertionPoint());
    parallel.erase();
  }
  loop.erase();
  return isDone;
}

namespace {

struct LockstepPass : piko::impl::LockstepBase<LockstepPass> {
  void runOnOperation() override;
};

} // namespace

void LockstepPass::runOnOperation() {
  SmallVector<ParallelForOp> parallels;
  getOperation().walk([&](ParallelForOp parallel) {
    if (!parallel->getParentOfType<KernelOp>())
      return;
    parallels.push_back(parallel);
    for (Operation *at = parallel; at; at = at->getParentOp())
      if (isa<scf::ForOp>(at))
        at->setAttr(marks::barriers, UnitAttr::get(&getContext()));
  });
  for (ParallelForOp parallel : parallels)
    if (!runInLockstep(parallel) && failed(LoopSplitter(parallel).run()))
      return signalPassFailure();
}
