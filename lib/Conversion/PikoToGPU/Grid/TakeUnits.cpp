// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-take-units: in each launch,
//   1. make append buffers empty where a block begins, and let the block take
//      what is in them where a unit ends;
//   2. put a loop over units around its work, and say which block runs which
//      unit (UnitCounter.cpp);
//   3. put counters and what loops need into shared memory where they would
//      take too many registers (BlockCounters.cpp).
// A kernel that precedes another one becomes a launch of that one's.

#include "PikoToGPU/Grid/GridFormer.h"
#include "PikoToGPU/Grid/GridMemory.h"
#include "PikoToGPU/Grid/UnitLoops.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Conversion/UnitOrder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Math/IR/Math.h"

namespace piko {
#define GEN_PASS_DEF_TAKEUNITS
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct TakeUnitsPass : piko::impl::TakeUnitsBase<TakeUnitsPass> {
  using TakeUnitsBase::TakeUnitsBase;
  void runOnOperation() override;
};

} // namespace

/// What follows `opened` in a block's work is done for one unit after the
/// other: the runtime may launch fewer blocks than there are units.
static scf::ForOp repeatForUnits(gpu::LaunchOp launch, Value bins,
                                 Operation *opened) {
  Location loc = launch.getLoc();
  OpBuilder builder = OpBuilder::atBlockBegin(&launch.getBody().front());
  // Large arrays of the block have a test around all that uses them.
  Block &body = *opened->getBlock();
  Value count = UnitCountOp::create(builder, loc, bins);
  builder.setInsertionPoint(body.getTerminator());
  Value first = launch.getBlockIds().x;
  auto units =
      scf::ForOp::create(builder, loc, first, count, launch.getGridSize().x);
  Value unit = units.getInductionVar();
  first.replaceAllUsesExcept(unit, units);
  units.getBody()->getOperations().splice(
      units.getBody()->begin(), body.getOperations(),
      std::next(opened->getIterator()), units->getIterator());
  builder.setInsertionPoint(units.getBody()->getTerminator());
  gpu::BarrierOp::create(builder, loc); // shared memory is used again
  return units;
}

/// Threads begin with empty append buffers, and leave what is in them at the
/// end of each unit.
static void takeUnitsOf(GridMemory &memory) {
  gpu::LaunchOp launch = memory.launch;
  auto kernel = launch->getParentOfType<KernelOp>();
  OpBuilder builder(memory.opened);
  memory.clearAppendBuffers(builder);
  if (memory.kept) {
    memory.clearKept(builder);
    gpu::BarrierOp::create(builder, launch.getLoc());
  }
  builder.setInsertionPoint(memory.opened->getBlock()->getTerminator());
  memory.flush(builder);
  bool inBlock = bool(launch->removeAttr(marks::blockCounters)),
       isRest = bool(launch->removeAttr(marks::rest));
  Value bins = (*kernel.getOps<OpenBinsOp>().begin()).getBins();
  scf::ForOp units = repeatForUnits(launch, bins, memory.opened);
  if (inBlock)
    countBucketsInBlock(units, launch);
  UnitOrder order = *getUnitOrder(kernel);
  if (order != UnitOrder::Fixed)
    takeUnits(units, launch, memory.log,
              /*dispatches=*/order == UnitOrder::Dispatched, inBlock);
  else if (inBlock)
    countUnitsInBlock(units, launch);
  for (scf::WhileOp loop : collect<scf::WhileOp>(launch))
    if (loop->removeAttr(marks::blockValues))
      keepInBlock(loop, launch);
  if (isRest)
    takeUnitsForRest(launch);
  if (launch->removeAttr(marks::blockBuffers))
    memory.keepAppendBuffersInBlock();
}

void TakeUnitsPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  for (gpu::LaunchOp launch : collect<gpu::LaunchOp>(pipeline)) {
    GridMemory memory(launch);
    if (!memory.opened || !launch->removeAttr(marks::threaded)) {
      launch.emitOpError("expected work that is mapped to threads, as "
                         "piko-map-blocks makes it");
      return signalPassFailure();
    }
    takeUnitsOf(memory);
  }
  auto kernels = llvm::to_vector(pipeline.getOps<KernelOp>());
  for (KernelOp kernel : llvm::reverse(kernels))
    if (FlatSymbolRefAttr next = kernel.getPrecedesAttr())
      launchBefore(lookupInPipeline<KernelOp>(kernel, next), kernel);
}
