// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "PikoToLLVM/Program/ProgramRegions.h"

using namespace mlir;
using namespace piko;

llvm::SmallSetVector<int32_t, 8>
piko::findStages(Operation *region, const PipelineNumbers &numbers) {
  llvm::SmallSetVector<int32_t, 8> stages;
  region->walk([&](LaunchOp launch) {
    for (StageOp stage : getStages(launch.getKernelOp()))
      stages.insert(numbers.stages.lookup(stage.getSymNameAttr()));
  });
  return stages;
}

int32_t piko::getNumber(Operation *region, bool asCycle) {
  auto isCounted = [&](Operation *op) {
    if (asCycle)
      return isa<WavesOp, RoundsOp>(op) && !op->getParentOfType<RoundsOp>();
    return op->getName() == region->getName();
  };
  int32_t number = 0;
  region->getParentOfType<ProgramOp>().walk<WalkOrder::PreOrder>(
      [&](Operation *op) {
        if (op == region)
          return WalkResult::interrupt();
        number += isCounted(op);
        return WalkResult::advance();
      });
  return number;
}

int32_t piko::getSourceNumber(SourceOp source) {
  auto all = getPipeline(source).getOps<SourceOp>();
  return static_cast<int32_t>(
      std::distance(all.begin(), llvm::find(all, source)));
}
