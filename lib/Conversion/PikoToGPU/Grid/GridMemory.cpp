// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The numbers of an append buffer and of a local edge are those of
// pikort/grid.h.

#include "PikoToGPU/Grid/GridMemory.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "pikort/grid.h"

#include "mlir/Dialect/Utils/StaticValueUtils.h"

using namespace mlir;
using namespace piko;

Value piko::addSharedMemory(gpu::LaunchOp launch, ArrayRef<int64_t> shape,
                            Type type) {
  auto space = gpu::AddressSpaceAttr::get(
      launch.getContext(), gpu::GPUDialect::getWorkgroupAddressSpace());
  return launch.addWorkgroupAttribution(
      MemRefType::get(shape, type, MemRefLayoutAttrInterface(), space),
      launch.getLoc());
}

SmallVector<gpu::LaunchOp> piko::findLaunches(PipelineOp pipeline) {
  SmallVector<gpu::LaunchOp> launches = collect<gpu::LaunchOp>(pipeline);
  llvm::erase_if(launches, [](gpu::LaunchOp launch) {
    return launch->hasAttr(marks::threaded);
  });
  return launches;
}

int64_t piko::getBlockSize(gpu::LaunchOp launch) {
  return *getConstantIntValue(launch.getBlockSizeX());
}

FailureOr<SmallVector<GridMemory>> piko::findGrids(PipelineOp pipeline) {
  SmallVector<GridMemory> grids;
  for (gpu::LaunchOp launch : findLaunches(pipeline)) {
    grids.emplace_back(launch);
    if (!grids.back().opened || !getConstantIntValue(launch.getBlockSizeX()))
      return launch.emitOpError("expected a constant size of blocks and "
                                "piko.gpu.append_buffers, as piko-form-grids "
                                "makes them");
  }
  return grids;
}

GridMemory::GridMemory(gpu::LaunchOp launch) : launch(launch) {
  launch.walk([&](AppendBuffersOp op) { opened = op; });
  if (!opened)
    return;
  log = opened.getLog();
  buffers = opened.getState();
  kept = opened.getKept();
  flushWords = opened.getWords();
  if (ArrayAttr producers = opened.getProducersAttr())
    for (auto [producer, port] : llvm::zip_equal(producers, *opened.getPorts()))
      locals.push_back({cast<FlatSymbolRefAttr>(producer), port});
}

int64_t GridMemory::getWords() {
  return (int64_t(locals.size()) + 1) * PIKOIR_APPEND_WORDS;
}

Attribute GridMemory::getStage() {
  return FlatSymbolRefAttr::get(getKernelStage(launch).getSymNameAttr());
}

bool GridMemory::isLocal(int64_t port) {
  Attribute stage = getStage();
  return llvm::any_of(locals, [&](const auto &edge) {
    return edge.first == stage && edge.second == port;
  });
}

int64_t GridMemory::getLocalBase(LocalBinOp local) {
  auto other = local.getSource().getDefiningOp<LogOfOp>();
  Attribute producer = other ? Attribute(other.getStageAttr()) : getStage();
  for (auto [i, edge] : llvm::enumerate(locals))
    if (producer == edge.first && local.getPort() == edge.second)
      return i * PIKOIR_LOCAL_WORDS;
  llvm_unreachable("a local edge of the kernel");
}

void GridMemory::flush(OpBuilder &builder) {
  FlushOp::create(builder, launch.getLoc(), log, launch.getBlockIds().x,
                  flushWords);
}

void GridMemory::clearAppendBuffers(OpBuilder &builder) {
  Location loc = launch.getLoc();
  Value zero = arith::ConstantIntOp::create(builder, loc, 0, 64);
  for (int64_t i = 0, e = getWords(); i < e; ++i)
    memref::StoreOp::create(
        builder, loc, zero, buffers,
        arith::ConstantIndexOp::create(builder, loc, i).getResult());
}

void GridMemory::clearKept(OpBuilder &builder) {
  Location loc = launch.getLoc();
  Value zero = arith::ConstantIntOp::create(builder, loc, 0, 64);
  for (int64_t i = 0, e = locals.size() * PIKOIR_LOCAL_WORDS; i < e; ++i)
    memref::StoreOp::create(
        builder, loc, zero, kept,
        arith::ConstantIndexOp::create(builder, loc, i).getResult());
}

void GridMemory::keepAppendBuffersInBlock() {
  Location loc = launch.getLoc();
  int64_t words = getWords(), threads = getBlockSize(launch);
  auto array = buffers.getDefiningOp<memref::AllocaOp>();
  OpBuilder builder(array);
  Type i64 = builder.getI64Type();
  // A word of all threads is in one piece: a warp finds it at once.
  Value all = addSharedMemory(launch, words * threads, i64);
  auto type =
      MemRefType::get(words, i64,
                      StridedLayoutAttr::get(builder.getContext(),
                                             ShapedType::kDynamic, threads),
                      cast<MemRefType>(all.getType()).getMemorySpace());
  buffers = memref::ReinterpretCastOp::create(
      builder, loc, type, all, OpFoldResult(launch.getThreadIds().x),
      ArrayRef<OpFoldResult>{builder.getIndexAttr(words)},
      ArrayRef<OpFoldResult>{builder.getIndexAttr(threads)});
  array.replaceAllUsesWith(buffers);
  array.erase();
}

void GridMemory::setPosition(OpBuilder &builder, Value position) {
  Location loc = launch.getLoc();
  Value word =
      arith::IndexCastOp::create(builder, loc, builder.getI64Type(), position);
  memref::StoreOp::create(
      builder, loc, word, buffers,
      arith::ConstantIndexOp::create(builder, loc, PIKOIR_APPEND_POSITION)
          .getResult());
}

static Value createPlace(OpBuilder &builder, Location loc, int64_t base) {
  return arith::ConstantIndexOp::create(builder, loc,
                                        base + PIKOIR_LOCAL_COUNT);
}

void GridMemory::setLocalCount(OpBuilder &builder, LocalBinOp local,
                               Value count) {
  memref::StoreOp::create(
      builder, local.getLoc(), count, kept,
      createPlace(builder, local.getLoc(), getLocalBase(local)));
}

Value GridMemory::getLocalCount(OpBuilder &builder, LocalBinOp local) {
  Location loc = local.getLoc();
  Value count = memref::LoadOp::create(
      builder, loc, kept, createPlace(builder, loc, getLocalBase(local)));
  return arith::IndexCastOp::create(builder, loc, builder.getIndexType(),
                                    count);
}
