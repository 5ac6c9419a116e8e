// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-map-blocks: in each launch that is not mapped yet,
//   1. convert access to state as convert-piko-to-scf does, where one outside
//      is an entry of the append buffer;
//   2. map the block's work to its threads (BlockMapping.cpp and
//      BarrierLoops.cpp);
//   3. let it leave units to the kernel's second launch (RareRounds.cpp).

#include "PikoToGPU/Blocks/BlockMapping.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Transforms/GreedyPatternRewriteDriver.h"

namespace piko {
#define GEN_PASS_DEF_MAPBLOCKS
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct MapBlocksPass : piko::impl::MapBlocksBase<MapBlocksPass> {
  using MapBlocksBase::MapBlocksBase;
  void runOnOperation() override;
};

} // namespace

static LogicalResult convertAccess(KernelOp kernel) {
  RewritePatternSet patterns(kernel.getContext());
  populatePikoToSCFPatterns(patterns);
  return applyPatternsGreedily(
      kernel, std::move(patterns),
      GreedyRewriteConfig().enableFolding(false).setRegionSimplificationLevel(
          GreedySimplifyRegionLevel::Disabled));
}

void MapBlocksPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  FailureOr<SmallVector<GridMemory>> grids = findGrids(pipeline);
  if (failed(grids))
    return signalPassFailure();
  for (auto kernel : pipeline.getOps<KernelOp>())
    if (failed(convertAccess(kernel)))
      return signalPassFailure();
  for (GridMemory &memory : *grids) {
    if (failed(mapBlock(memory)))
      return signalPassFailure();
    mapRareRounds(memory);
    memory.launch->setAttr(marks::threaded, UnitAttr::get(&getContext()));
  }
}
