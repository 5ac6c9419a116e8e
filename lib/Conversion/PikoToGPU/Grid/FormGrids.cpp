// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-form-grids: for each kernel,
//   1. check the mapping to threads, and what no grid can do (GridLimits.cpp);
//   2. make a launch with a block for each unit of the stored bins, and in it
//      loops over its buckets and their primitives (GridFormer.cpp);
//   3. open append buffers for what threads emit, and say what a block has of
//      local edges.

#include "PikoToGPU/Grid/GridFormer.h"
#include "PikoToGPU/Grid/GridMemory.h"
#include "PikoToGPU/Mapping/WorkLegality.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Conversion/UnitOrder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "pikort/grid.h"

namespace piko {
#define GEN_PASS_DEF_FORMGRIDS
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct FormGridsPass : piko::impl::FormGridsBase<FormGridsPass> {
  using FormGridsBase::FormGridsBase;
  void runOnOperation() override;
};

} // namespace

//===----------------------------------------------------------------------===//
// Append buffers and local edges
//===----------------------------------------------------------------------===//

using LocalEdges = SmallVector<std::pair<FlatSymbolRefAttr, int64_t>>;

/// Those whose ends are both in the work.
static LocalEdges findLocalEdges(Operation *work) {
  LocalEdges locals;
  work->walk([&](WorkOpInterface piece) {
    FlatSymbolRefAttr producer = piece.getProducerAttr();
    if (producer && !piece->hasAttr(marks::again))
      locals.push_back({producer, piece.getPortAttr().getInt()});
  });
  return locals;
}

static void openAppendBuffers(gpu::LaunchOp launch, Value log,
                              const LocalEdges &locals) {
  OpBuilder builder = OpBuilder::atBlockBegin(&launch.getBody().front());
  Location loc = launch.getLoc();
  Type i64 = builder.getI64Type();
  int64_t count = locals.size();
  Value buffers = memref::AllocaOp::create(
      builder, loc, MemRefType::get({(count + 1) * PIKOIR_APPEND_WORDS}, i64));
  Value words = addSharedMemory(launch, PIKOIR_FLUSH_WORDS, i64), kept;
  ArrayAttr producers;
  DenseI64ArrayAttr ports;
  if (count > 0) {
    kept = addSharedMemory(launch, count * PIKOIR_LOCAL_WORDS, i64);
    producers = builder.getArrayAttr(llvm::map_to_vector(
        locals, [](auto edge) -> Attribute { return edge.first; }));
    ports = builder.getDenseI64ArrayAttr(
        llvm::map_to_vector(locals, [](auto edge) { return edge.second; }));
  }
  bool emits = contains(launch, [](Operation *op) {
    return isa<AppendOp, AppendBinOp, NextOp>(op);
  });
  AppendBuffersOp::create(builder, loc, log, buffers, words, producers, ports,
                          kept, /*forErrors=*/!emits);
}

/// What the block has of a local edge is one bucket, or as many calls as there
/// are batches; an empty one is called only if the stage runs for every bin.
static void convertLocal(LocalBinOp local, GridMemory &memory) {
  Location loc = memory.launch.getLoc();
  auto stage = lookupInPipeline<StageOp>(local, local.getStageAttr());
  ScheduleOp schedule = stage.getSchedule();
  OpBuilder builder = OpBuilder::atBlockBegin(local.getBodyBlock());
  auto constant = [&](int64_t value) -> Value {
    return arith::ConstantIndexOp::create(builder, loc, value);
  };
  Value count = memory.getLocalCount(builder, local), zero = constant(0);
  Value batch =
      schedule && schedule.getBatch() ? constant(*schedule.getBatch()) : count;
  batch = arith::MaxSIOp::create(builder, loc, batch, constant(1));
  Value calls = arith::CeilDivUIOp::create(builder, loc, count, batch);
  if (schedule && schedule.getEveryBin())
    calls = arith::MaxSIOp::create(builder, loc, calls, constant(1));
  for (Operation *user :
       llvm::make_early_inc_range(local.getBins().getUsers())) {
    builder.setInsertionPoint(user);
    if (isa<UnitBucketsOp>(user)) {
      user->replaceAllUsesWith(ValueRange{zero, calls});
    } else if (isa<BucketRangeOp>(user)) {
      user->replaceAllUsesWith(ValueRange{zero, count});
    } else if (auto range = dyn_cast<CallRangeOp>(user)) {
      Value begin = arith::MulIOp::create(builder, loc, range.getCall(), batch);
      Value end = arith::AddIOp::create(builder, loc, begin, batch);
      end = arith::MinSIOp::create(builder, loc, end, count);
      user->replaceAllUsesWith(ValueRange{begin, end});
    } else {
      continue;
    }
    user->erase();
  }
}

//===----------------------------------------------------------------------===//
// Kernels
//===----------------------------------------------------------------------===//

/// Fails, with an error, at a mapping that does not hold.
static LogicalResult checkMapping(KernelOp kernel, int64_t threads) {
  WalkResult result = kernel.walk([&](Operation *op) -> WalkResult {
    auto mark = op->getAttrOfType<ThreadMappingAttr>(marks::threads);
    if (!mark || isLegal(op, mark.getValue(), threads))
      return WalkResult::advance();
    return op->emitOpError("cannot be shared by threads as ") << mark;
  });
  return failure(result.wasInterrupted());
}

/// The threads of a block; an error where that is no number of them.
static FailureOr<int64_t> takeBlockSize(KernelOp kernel) {
  auto size = kernel->getAttrOfType<IntegerAttr>(marks::blockSize);
  if (!size)
    return kernel.emitOpError("expected a mapping to threads, as "
                              "piko-map-threads makes it");
  if (size.getInt() < 1 || size.getInt() > maxThreads ||
      !llvm::isPowerOf2_64(size.getInt()))
    return kernel.emitOpError("expected a power of two up to ")
           << maxThreads << " for the threads of a block, but got "
           << size.getInt();
  kernel->removeAttr(marks::blockSize);
  return size.getInt();
}

static LogicalResult formGrid(KernelOp kernel) {
  Operation *work = findWork(kernel);
  if (!work) {
    if (kernel.getOps<BeginScheduleOp>().empty())
      return kernel.emitOpError(
          "expected work on bins, as piko-form-work makes it");
    return success();
  }
  FailureOr<int64_t> threads = takeBlockSize(kernel);
  if (failed(threads) || failed(checkGridLimits(kernel)) ||
      failed(checkMapping(kernel, *threads)))
    return failure();
  LocalEdges locals = findLocalEdges(work);
  GridFormer former(kernel, work, *threads);
  former.run();
  dropEnds(kernel, former.launch);
  openAppendBuffers(former.launch, former.log, locals);
  GridMemory memory(former.launch);
  for (LocalBinOp local : collect<LocalBinOp>(former.launch))
    convertLocal(local, memory);
  return success();
}

void FormGridsPass::runOnOperation() {
  for (auto kernel : llvm::to_vector(getOperation().getOps<KernelOp>()))
    if (failed(formGrid(kernel)))
      return signalPassFailure();
}
