// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-share-pixels: in each launch whose threads share the pixels of a bin, as
// piko-map-threads says,
//   collapsed  take primitives in groups, whose pixels are one space
//              (CollapsedPixels.cpp and PixelUpdates.cpp), and leave rare ones
//              to a second launch (RareLaunch.cpp);
//   pixels     let threads have some pixels of one primitive after the other
//              (PixelSharing.cpp), whose setup they share (ItemSetup.cpp).

#include "PikoToGPU/Mapping/SetupSplit.h"
#include "PikoToGPU/Pixels/CollapsedPixels.h"
#include "PikoToGPU/Pixels/PixelSharing.h"

#include "Piko/Transforms/Storage/ParallelLoops.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Math/IR/Math.h"

namespace piko {
#define GEN_PASS_DEF_SHAREPIXELS
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct SharePixelsPass : piko::impl::SharePixelsBase<SharePixelsPass> {
  using SharePixelsBase::SharePixelsBase;
  void runOnOperation() override;
};

} // namespace

/// The loop over primitives whose pixels threads share, if there is one.
static scf::ForOp findItems(gpu::LaunchOp launch) {
  scf::ForOp items;
  launch.walk([&](scf::ForOp loop) {
    auto mark = loop->getAttrOfType<ThreadMappingAttr>(marks::threads);
    if (mark && (mark.getValue() == ThreadMapping::Pixels ||
                 mark.getValue() == ThreadMapping::Collapsed))
      items = loop;
  });
  return items;
}

/// An alloca in a loop would take more memory each time around.
static void hoistPrivateArrays(gpu::LaunchOp launch) {
  Block &body = launch.getBody().front();
  auto arrays = collect<memref::AllocaOp>(launch);
  for (memref::AllocaOp array : llvm::reverse(arrays))
    array->moveBefore(&body, body.begin());
}

static ThreadTile createTile(gpu::LaunchOp launch, StageOp stage) {
  ThreadTile tile(getBlockSize(launch), stage.getBins().size());
  OpBuilder builder = OpBuilder::atBlockBegin(&launch.getBody().front());
  Location loc = launch.getLoc();
  Value rest = launch.getThreadIds().x;
  for (int64_t extent : tile.extents) {
    Value size = arith::ConstantIndexOp::create(builder, loc, extent);
    tile.place.push_back(arith::RemUIOp::create(builder, loc, rest, size));
    rest = arith::DivUIOp::create(builder, loc, rest, size);
  }
  return tile;
}

static LogicalResult collapse(scf::ForOp items, StageOp stage,
                              const ThreadTile &tile, GridMemory &memory) {
  PixelNestResult found = findPixelNest(items, stage);
  if (!found.nest)
    return emitError(found.obstacle.at) << found.obstacle.text;
  SetupSplit split(items, Extent::All, /*own=*/{}, found.nest->rare);
  if (auto obstacle =
          findObstacleToGroups(items, split, *found.nest,
                               PixelGroup(getBlockSize(memory.launch), stage)))
    return emitError(obstacle->at) << obstacle->text;
  FailureOr<RareSite> rare =
      collapsePixels(items, *found.nest, stage, tile, memory);
  if (failed(rare))
    return failure();
  hoistPrivateArrays(memory.launch);
  memory.launch->setAttr(marks::blockCounters,
                         UnitAttr::get(items.getContext()));
  leaveRareToSecondLaunch(*rare, memory.launch);
  return success();
}

static LogicalResult sharePixelsOf(scf::ForOp items, GridMemory &memory) {
  gpu::LaunchOp launch = memory.launch;
  StageOp stage = getKernelStage(launch);
  launch->setAttr(marks::threaded, UnitAttr::get(launch.getContext()));
  ThreadMapping mapping =
      items->getAttrOfType<ThreadMappingAttr>(marks::threads).getValue();
  llvm::for_each(collect<ParallelLoopOpInterface>(launch), convertLoop);
  launch.walk([](scf::ForOp loop) {
    loop->removeAttr(marks::threads);
    loop->removeAttr(marks::lanes);
  });
  hoistOutOfPixelLoops(items);
  ThreadTile tile = createTile(launch, stage);
  if (mapping == ThreadMapping::Collapsed)
    return collapse(items, stage, tile, memory);
  if (failed(sharePixels(items, tile)))
    return failure();
  hoistPrivateArrays(launch);
  shareSetup(items, tile, memory);
  return success();
}

void SharePixelsPass::runOnOperation() {
  FailureOr<SmallVector<GridMemory>> grids = findGrids(getOperation());
  if (failed(grids))
    return signalPassFailure();
  for (GridMemory &memory : *grids)
    if (scf::ForOp items = findItems(memory.launch))
      if (failed(sharePixelsOf(items, memory)))
        return signalPassFailure();
}
