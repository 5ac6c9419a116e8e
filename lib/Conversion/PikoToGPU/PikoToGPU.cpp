// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-piko-to-gpu: for each kernel, as piko-map-threads says,
//   1. make a launch with a block for each unit of the stored bins, and in it
//      loops over its buckets and their primitives (GridFormer); where there
//      are fewer blocks, say which runs which unit (UnitCounter.cpp);
//   2. where threads share pixels, take primitives in groups, whose setup they
//      share (CollapsedPixels.cpp and RareLaunch.cpp, or PixelSharing.cpp and
//      ItemSetup.cpp);
//   3. otherwise convert loops as they are mapped (BarrierLoops.cpp), put off
//      those of atomics (CompactedWork.cpp), set rare branches apart
//      (RareBranches.cpp and RareRounds.cpp), and map the block's work to its
//      threads (BlockMapping.cpp);
//   4. convert access to state as convert-piko-to-scf does, where one outside
//      is an entry of the append buffer, and open a log for what the grid
//      leaves;
//   5. if it precedes another kernel, become a launch of that one's.

#include "PikoToGPU/PikoToGPU.h"
#include "PikoToGPU/CollapsedPixels.h"
#include "PikoToGPU/GridFormer.h"
#include "PikoToGPU/Mapping/SetupSplit.h"

#include "Piko/Transforms/Storage/LoopSplitter.h"
#include "Piko/Transforms/Storage/ParallelLoops.h"

#include "Piko/Conversion/UnitOrder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"

#include "pikort/grid.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Transforms/GreedyPatternRewriteDriver.h"

namespace piko {
#define GEN_PASS_DEF_CONVERTPIKOTOGPU
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// What may be left out.
struct GridOptions {
  bool compacts, splitsRare;
};

class GridBuilder {
public:
  GridBuilder(KernelOp kernel, StageOp stage, int64_t threads,
              GridOptions options)
      : kernel(kernel), stage(stage), threads(threads), options(options),
        loc(kernel.getLoc()), order(*getUnitOrder(kernel)) {}

  /// Threads share the pixels of a bin, of one primitive after the other or of
  /// many.
  LogicalResult sharePixelsOfBins(ThreadMapping mapping);
  /// Threads share primitives and iterations.
  LogicalResult mapWork();

private:
  void formGrid();
  /// Opens append buffers; `work` is what the grid was made of.
  void createMemory();
  void convertLocal(LocalBinOp local);
  LogicalResult finish(GridMemory &memory, bool hasRare);
  void finishGrid(GridMemory &memory, bool countsInBlock);
  SmallVector<scf::ForOp> takeMapping(ThreadMapping mapping);
  void hoistPrivateArrays();
  ThreadTile createTile();
  LogicalResult mapLoop(ParallelLoopOpInterface loop);
  LogicalResult mapPieces(ParallelForOp loop, bool isShared);
  LogicalResult convertAccess();

  KernelOp kernel;
  StageOp stage;
  int64_t threads;
  GridOptions options;
  Location loc;
  UnitOrder order;
  Value bins;
  gpu::LaunchOp launch;
  GridMemory memory;
};

struct ConvertPikoToGPUPass
    : piko::impl::ConvertPikoToGPUBase<ConvertPikoToGPUPass> {
  using ConvertPikoToGPUBase::ConvertPikoToGPUBase;
  void runOnOperation() override;
  LogicalResult convert(KernelOp kernel);
};

} // namespace

void GridBuilder::formGrid() {
  Operation *work = findWork(kernel);
  work->walk([&](WorkOpInterface piece) {
    FlatSymbolRefAttr producer = piece.getProducerAttr();
    if (producer && !piece->hasAttr(marks::again))
      memory.locals.push_back({producer, piece.getPortAttr().getInt()});
  });
  memory.stage = getStageName(work);
  GridFormer former(kernel, work, threads);
  former.run();
  memory.launch = launch = former.launch;
  memory.log = former.log;
  bins = former.bins;
  dropEnds(kernel, launch);
  createMemory();
  launch.walk([&](LocalBinOp local) { convertLocal(local); });
}

void GridBuilder::createMemory() {
  OpBuilder builder = OpBuilder::atBlockBegin(&launch.getBody().front());
  Type i64 = builder.getI64Type();
  memory.buffers = memref::AllocaOp::create(
      builder, loc, MemRefType::get({memory.getWords()}, i64));
  memory.flushWords = addSharedMemory(launch, PIKOIR_FLUSH_WORDS, i64);
  ArrayAttr producers;
  DenseI64ArrayAttr ports;
  if (!memory.locals.empty()) {
    int64_t count = memory.locals.size();
    memory.kept = addSharedMemory(launch, count * PIKOIR_LOCAL_WORDS, i64);
    producers = builder.getArrayAttr(llvm::map_to_vector(
        memory.locals, [](auto edge) -> Attribute { return edge.first; }));
    ports = builder.getDenseI64ArrayAttr(llvm::map_to_vector(
        memory.locals, [](auto edge) { return edge.second; }));
  }
  bool emits = contains(launch, [](Operation *op) {
    return isa<AppendOp, AppendBinOp, NextOp>(op);
  });
  AppendBuffersOp::create(builder, loc, memory.log, memory.buffers, producers,
                          ports, memory.kept, /*forErrors=*/!emits);
}

/// What the block has of a local edge is one bucket, or as many calls as there
/// are batches; an empty one is called only if the stage runs for every bin.
void GridBuilder::convertLocal(LocalBinOp local) {
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

/// Threads begin with empty append buffers, and leave what is in them at the
/// end of each unit. `countsInBlock`: the numbers of the unit and the bucket
/// take no registers.
void GridBuilder::finishGrid(GridMemory &memory, bool countsInBlock) {
  auto opened = *memory.buffers.getUsers().begin();
  for (Operation *user : memory.buffers.getUsers())
    if (isa<AppendBuffersOp>(user))
      opened = user;
  OpBuilder builder(opened);
  memory.clearAppendBuffers(builder);
  if (memory.kept) {
    Value zero = arith::ConstantIntOp::create(builder, loc, 0, 64);
    int64_t words = memory.locals.size() * PIKOIR_LOCAL_WORDS;
    for (int64_t i = 0; i < words; ++i)
      memref::StoreOp::create(
          builder, loc, zero, memory.kept,
          arith::ConstantIndexOp::create(builder, loc, i).getResult());
    gpu::BarrierOp::create(builder, loc);
  }
  builder.setInsertionPoint(opened->getBlock()->getTerminator());
  memory.flush(builder);
  scf::ForOp units = repeatForUnits(memory.launch, bins, opened);
  if (countsInBlock)
    countBucketsInBlock(units, memory.launch);
  if (order != UnitOrder::Fixed)
    takeUnits(units, memory.launch, memory.log,
              /*dispatches=*/order == UnitOrder::Dispatched, countsInBlock);
  else if (countsInBlock)
    countUnitsInBlock(units, memory.launch);
}

/// An alloca in a loop would take more memory each time around.
void GridBuilder::hoistPrivateArrays() {
  Block &body = launch.getBody().front();
  SmallVector<memref::AllocaOp> arrays;
  launch.walk([&](memref::AllocaOp array) { arrays.push_back(array); });
  for (memref::AllocaOp array : llvm::reverse(arrays))
    array->moveBefore(&body, body.begin());
}

ThreadTile GridBuilder::createTile() {
  ThreadTile tile(threads, stage.getBins().size());
  OpBuilder builder = OpBuilder::atBlockBegin(&launch.getBody().front());
  Value rest = launch.getThreadIds().x;
  for (int64_t extent : tile.extents) {
    Value size = arith::ConstantIndexOp::create(builder, loc, extent);
    tile.place.push_back(arith::RemUIOp::create(builder, loc, rest, size));
    rest = arith::DivUIOp::create(builder, loc, rest, size);
  }
  return tile;
}

LogicalResult GridBuilder::convertAccess() {
  RewritePatternSet patterns(kernel.getContext());
  populatePikoToSCFPatterns(patterns);
  return applyPatternsGreedily(
      kernel, std::move(patterns),
      GreedyRewriteConfig().enableFolding(false).setRegionSimplificationLevel(
          GreedySimplifyRegionLevel::Disabled));
}

LogicalResult GridBuilder::sharePixelsOfBins(ThreadMapping mapping) {
  formGrid();
  SmallVector<ParallelLoopOpInterface> loops;
  launch.walk([&](ParallelLoopOpInterface loop) { loops.push_back(loop); });
  for (ParallelLoopOpInterface loop : loops)
    convertLoop(loop);
  scf::ForOp items = takeMapping(mapping).front();
  hoistOutOfPixelLoops(items);
  ThreadTile tile = createTile();
  FailureOr<RareSite> rare = failure();
  if (mapping == ThreadMapping::Collapsed) {
    PixelNestResult found = findPixelNest(items, stage);
    if (!found.nest)
      return emitError(found.obstacle.at) << found.obstacle.text;
    SetupSplit split(items, Extent::All, /*own=*/{}, found.nest->rare);
    if (auto obstacle = findObstacleToGroups(items, split, *found.nest,
                                             PixelGroup(threads, stage)))
      return emitError(obstacle->at) << obstacle->text;
    rare = collapsePixels(items, *found.nest, stage, tile, memory);
    if (failed(rare))
      return failure();
    hoistPrivateArrays();
  } else {
    if (failed(sharePixels(items, tile)))
      return failure();
    hoistPrivateArrays();
    shareSetup(items, tile, memory);
  }
  if (failed(convertAccess()))
    return failure();
  finishGrid(memory, /*countsInBlock=*/succeeded(rare));
  if (succeeded(rare))
    leaveRareToSecondLaunch(*rare, launch);
  return success();
}

/// The loops over primitives that are mapped so.
SmallVector<scf::ForOp> GridBuilder::takeMapping(ThreadMapping mapping) {
  SmallVector<scf::ForOp> found;
  launch.walk([&](scf::ForOp loop) {
    auto mark = loop->getAttrOfType<ThreadMappingAttr>(marks::threads);
    if (mark && mark.getValue() == mapping)
      found.push_back(loop);
    loop->removeAttr(marks::threads);
    loop->removeAttr(marks::lanes);
  });
  return found;
}

/// Cuts a loop at its barriers; threads share each of its pieces that allows
/// it.
LogicalResult GridBuilder::mapPieces(ParallelForOp loop, bool isShared) {
  if (failed(LoopSplitter(loop, memory.log, isShared).run()))
    return failure();
  launch.walk([&](scf::ForOp piece) {
    bool isApart = bool(piece->removeAttr(marks::disjoint));
    if (piece->removeAttr(marks::lanes) && isShared &&
        (isApart || isIndependent(piece)))
      piece->setAttr(marks::shared, UnitAttr::get(kernel.getContext()));
  });
  return success();
}

LogicalResult GridBuilder::mapLoop(ParallelLoopOpInterface loop) {
  auto mark = loop->getAttrOfType<ThreadMappingAttr>(marks::threads);
  if (!mark)
    return loop->emitOpError("expected a mapping to threads, as "
                             "piko-map-threads makes it");
  loop->removeAttr(marks::threads);
  ThreadMapping mapping = mark.getValue();
  if (mapping == ThreadMapping::One) {
    convertLoop(loop);
    launch.walk([](scf::ForOp made) { made->removeAttr(marks::lanes); });
    return success();
  }
  auto pixels = dyn_cast<ParallelPixelsOp>(*loop);
  auto numbered =
      pixels ? numberIterations(pixels) : cast<ParallelForOp>(*loop);
  switch (mapping) {
  case ThreadMapping::Pieces:
  case ThreadMapping::PiecesOfOne:
    return mapPieces(numbered, mapping == ThreadMapping::Pieces);
  case ThreadMapping::Lockstep:
    return success(); // BlockMapping.cpp does the rest
  case ThreadMapping::Shared:
    convertLoop(numbered);
    launch.walk([&](scf::ForOp made) {
      if (made->removeAttr(marks::lanes))
        made->setAttr(marks::shared, UnitAttr::get(kernel.getContext()));
    });
    return success();
  default:
    llvm_unreachable("checkMapping refuses others");
  }
}

/// Where there are as many primitives as it takes, threads have some each;
/// otherwise they share the iterations of one after the other.
static void createVersions(scf::ForOp loop) {
  MLIRContext *context = loop.getContext();
  OpBuilder builder(loop);
  Location loc = loop.getLoc();
  int64_t fewest = cast<IntegerAttr>(loop->removeAttr(marks::fewest)).getInt();
  Value count = arith::SubIOp::create(builder, loc, loop.getUpperBound(),
                                      loop.getLowerBound());
  Value many = arith::CmpIOp::create(
      builder, loc, arith::CmpIPredicate::sge, count,
      arith::ConstantIndexOp::create(builder, loc, fewest));
  auto choice = scf::IfOp::create(builder, loc, many, /*withElseRegion=*/true);
  OpBuilder otherwise = choice.getElseBodyBuilder();
  auto mark = [&](Operation *op, ThreadMapping mapping) {
    op->setAttr(marks::threads, ThreadMappingAttr::get(context, mapping));
  };
  mark(otherwise.clone(*loop), ThreadMapping::One);
  loop->moveBefore(choice.thenBlock()->getTerminator());
  mark(loop, ThreadMapping::Shared);
  loop->walk(
      [&](ParallelLoopOpInterface inner) { mark(inner, ThreadMapping::One); });
}

LogicalResult GridBuilder::mapWork() {
  formGrid();
  SmallVector<scf::ForOp> byCount;
  launch.walk([&](scf::ForOp loop) {
    if (loop->hasAttr(marks::fewest))
      byCount.push_back(loop);
  });
  llvm::for_each(byCount, createVersions);
  launch.walk([&](scf::ForOp loop) {
    auto mark = loop->getAttrOfType<ThreadMappingAttr>(marks::threads);
    bool emits = contains(
        loop, [](Operation *op) { return isa<AppendOp, AppendBinOp>(op); });
    if (mark && mark.getValue() == ThreadMapping::One && emits)
      memory.ordered.insert(loop);
  });
  for (scf::ForOp loop : takeMapping(ThreadMapping::Shared))
    loop->setAttr(marks::shared, UnitAttr::get(kernel.getContext()));
  SmallVector<ParallelLoopOpInterface> loops; // those inside others first
  launch.walk([&](ParallelLoopOpInterface loop) { loops.push_back(loop); });
  for (ParallelLoopOpInterface loop : loops)
    if (failed(mapLoop(loop)))
      return failure();
  SmallVector<scf::ForOp> shared;
  launch.walk([&](scf::ForOp loop) {
    if (loop->hasAttr(marks::shared))
      shared.push_back(loop);
  });
  for (scf::ForOp loop : shared)
    if (options.compacts)
      compactWork(loop, memory, threads);
  std::optional<GridMemory> rest;
  bool hasRare = false;
  // What a launch leaves is for the kernel itself.
  if (kernel.getPrecedes() || !options.splitsRare)
    shared.clear();
  for (scf::ForOp loop : shared) {
    bool isRare = setRareBranchesApart(loop);
    if (isRare && !rest)
      rest = leaveRareRounds(loop, memory);
    hasRare |= isRare;
  }
  if (failed(convertAccess()) || failed(finish(memory, hasRare)))
    return failure();
  return rest ? finish(*rest, hasRare) : success();
}

/// Maps a launch's work; what it leaves, or has to be left, is known.
LogicalResult GridBuilder::finish(GridMemory &memory, bool hasRare) {
  if (failed(mapBlock(memory)))
    return failure();
  beginQueues(memory);
  if (memory.rare)
    finishRareRounds(memory);
  finishGrid(memory, /*countsInBlock=*/hasRare);
  if (memory.rare && !memory.rare->found)
    takeUnitsForRest(memory.launch);
  if (hasRare)
    memory.keepAppendBuffersInBlock(threads);
  return success();
}

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

/// How threads share the pixels of a bin, if they do.
static std::optional<ThreadMapping> findPixelMapping(KernelOp kernel) {
  std::optional<ThreadMapping> found;
  kernel.walk([&](ItemsOp items) {
    auto mark = items->getAttrOfType<ThreadMappingAttr>(marks::threads);
    if (mark && (mark.getValue() == ThreadMapping::Pixels ||
                 mark.getValue() == ThreadMapping::Collapsed))
      found = mark.getValue();
  });
  return found;
}

LogicalResult ConvertPikoToGPUPass::convert(KernelOp kernel) {
  Operation *work = findWork(kernel);
  if (!work) {
    if (kernel.getOps<BeginScheduleOp>().empty())
      return kernel.emitOpError(
          "expected work on bins, as piko-form-work makes it");
    return success();
  }
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
  if (failed(checkGridLimits(kernel)) ||
      failed(checkMapping(kernel, size.getInt())))
    return failure();
  auto stage = lookupInPipeline<StageOp>(kernel, getStageName(work));
  GridBuilder builder(kernel, stage, size.getInt(), {compacts, splitsRare});
  std::optional<ThreadMapping> pixels = findPixelMapping(kernel);
  return pixels ? builder.sharePixelsOfBins(*pixels) : builder.mapWork();
}

void ConvertPikoToGPUPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  for (auto kernel : llvm::to_vector(pipeline.getOps<KernelOp>()))
    if (failed(convert(kernel)))
      return signalPassFailure();
  auto kernels = llvm::to_vector(pipeline.getOps<KernelOp>());
  for (KernelOp kernel : llvm::reverse(kernels))
    if (FlatSymbolRefAttr next = kernel.getPrecedesAttr())
      launchBefore(lookupInPipeline<KernelOp>(kernel, next), kernel);
}
