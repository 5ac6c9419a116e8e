// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-piko-to-gpu: for each kernel,
//   1. make a launch with a block for each unit of the stored bins, and in it
//      loops over its cells and their primitives (GridFormer); where there are
//      fewer blocks, say which runs which unit (UnitCounter.cpp);
//   2. if all that others see of it are pixels, share these among the block's
//      threads, and take primitives in groups, whose setup the threads share
//      (CollapsedPixels.cpp and RareLaunch.cpp, or PixelSharing.cpp and
//      ItemSetup.cpp);
//   3. otherwise choose who takes which loop (SharedLoops.cpp), put off those
//      of atomics (DeferredWork.cpp), set rare branches apart (RareBranches.cpp
//      and RareRounds.cpp), and map the block's work to its threads
//      (BlockMapping.cpp);
//   4. convert access to state, and open a log for what the grid leaves;
//   5. if it precedes another kernel, become a launch of that one's.

#include "PikoToGPU.h"
#include "CollapsedPixels.h"
#include "GridFormer.h"

#include "../../Transforms/LoopSplitter.h"
#include "../../Transforms/ParallelLoops.h"

#include "Piko/Conversion/UnitOrder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"

#include "pikort/grid.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/SCF/Transforms/Transforms.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Transforms/GreedyPatternRewriteDriver.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/Support/MathExtras.h"

namespace piko {
#define GEN_PASS_DEF_CONVERTPIKOTOGPU
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

class GridBuilder {
public:
  GridBuilder(KernelOp kernel, StageOp stage, int64_t threads)
      : kernel(kernel), stage(stage), threads(threads), loc(kernel.getLoc()),
        order(*getUnitOrder(kernel)) {}

  /// Threads share the pixels of a bin, of one primitive after the other or of
  /// many; fails where they cannot.
  LogicalResult sharePixelsOfBins(bool collapses);
  /// Threads do what SharedLoops.cpp and BlockMapping.cpp say.
  LogicalResult mapWork();

private:
  void formGrid();
  /// Opens outboxes; `work` is what the grid was made of.
  void createMemory();
  void convertLocal(LocalBinOp local);
  LogicalResult finish(GridMemory &memory, bool hasRare);
  void finishGrid(GridMemory &memory, bool countsInBlock);
  LogicalResult findItems();
  void hoistPrivateArrays();
  void upliftLoops();
  ThreadTile createTile();
  LogicalResult mapLoop(ParallelLoopOpInterface loop);
  void obeyLanes();
  LogicalResult mapPieces(ParallelForOp loop, bool isOne);
  LogicalResult convertAccess();

  KernelOp kernel;
  StageOp stage;
  int64_t threads;
  Location loc;
  UnitOrder order;
  scf::ForOp items;
  Value bins;
  gpu::LaunchOp launch;
  GridMemory memory;
};

/// Why threads cannot do something, if it is known.
struct Obstacle {
  Location at;
  std::string text;
};

struct ConvertPikoToGPUPass
    : piko::impl::ConvertPikoToGPUBase<ConvertPikoToGPUPass> {
  using ConvertPikoToGPUBase::ConvertPikoToGPUBase;
  void runOnOperation() override;
  LogicalResult convert(KernelOp kernel);
  bool sharePixels(KernelOp kernel, StageOp stage, int64_t count);
  std::optional<Obstacle> tryToSharePixels(KernelOp kernel, StageOp stage,
                                           int64_t count, bool collapses);
};

} // namespace

LogicalResult GridBuilder::findItems() {
  launch.walk([&](scf::ForOp loop) {
    if (loop->hasAttr(marks::lanes) && loop->getParentOfType<scf::ForOp>() &&
        !loop->getParentOfType<scf::ForOp>()->getParentOfType<scf::ForOp>())
      items = loop;
  });
  return success(items && !items.getNumResults() &&
                 !items.getBody()->getOps<ItemOp>().empty());
}

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
  memory.outboxes = memref::AllocaOp::create(
      builder, loc, MemRefType::get({memory.getWords()}, i64));
  memory.cells = addBlockMemory(launch, PIKOIR_FLUSH_CELLS, i64);
  ArrayAttr producers;
  DenseI64ArrayAttr ports;
  if (!memory.locals.empty()) {
    int64_t count = memory.locals.size();
    memory.kept = addBlockMemory(launch, count * PIKOIR_LOCAL_WORDS, i64);
    producers = builder.getArrayAttr(llvm::map_to_vector(
        memory.locals, [](auto edge) -> Attribute { return edge.first; }));
    ports = builder.getDenseI64ArrayAttr(llvm::map_to_vector(
        memory.locals, [](auto edge) { return edge.second; }));
  }
  bool emits = contains(launch, [](Operation *op) {
    return isa<AppendOp, AppendBinOp, NextOp>(op);
  });
  OutboxesOp::create(builder, loc, memory.log, memory.outboxes, producers,
                     ports, memory.kept, /*forErrors=*/!emits);
}

/// What the block has of a local edge is one cell, or as many calls as there
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
    if (isa<UnitCellsOp>(user)) {
      user->replaceAllUsesWith(ValueRange{zero, calls});
    } else if (isa<CellRangeOp>(user)) {
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

/// Threads begin with empty outboxes, and leave what is in them at the end of
/// each unit. `countsInBlock`: the numbers of the unit and the cell take no
/// registers.
void GridBuilder::finishGrid(GridMemory &memory, bool countsInBlock) {
  auto opened = *memory.outboxes.getUsers().begin();
  for (Operation *user : memory.outboxes.getUsers())
    if (isa<OutboxesOp>(user))
      opened = user;
  OpBuilder builder(opened);
  memory.clearOutboxes(builder);
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
    countCellsInBlock(units, memory.launch);
  if (order == UnitOrder::Taken)
    takeUnits(units, memory.launch, memory.log, countsInBlock);
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

/// Makes loops that count of those that C++ has. A number that is never used
/// becomes 0: it would be an argument of the kernel.
void GridBuilder::upliftLoops() {
  IRRewriter rewriter(kernel.getContext());
  SmallVector<scf::WhileOp> loops;
  launch.walk([&](scf::WhileOp loop) { loops.push_back(loop); });
  for (scf::WhileOp loop : loops) {
    rewriter.setInsertionPoint(loop);
    (void)scf::upliftWhileToForLoop(rewriter, loop);
  }
  for (auto poison : llvm::to_vector(kernel.getOps<ub::PoisonOp>())) {
    rewriter.setInsertionPoint(poison);
    if (TypedAttr zero = rewriter.getZeroAttr(poison.getType()))
      rewriter.replaceOpWithNewOp<arith::ConstantOp>(poison, zero);
  }
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

LogicalResult GridBuilder::sharePixelsOfBins(bool collapses) {
  formGrid();
  SmallVector<ParallelLoopOpInterface> loops;
  launch.walk([&](ParallelLoopOpInterface loop) { loops.push_back(loop); });
  for (ParallelLoopOpInterface loop : loops)
    convertLoop(loop);
  if (failed(findItems()))
    return failure();
  upliftLoops();
  useClosedFormsInPixelLoops(items);
  ThreadTile tile = createTile();
  FailureOr<RareSite> rare = failure();
  if (collapses) {
    PixelNestResult found = findPixelNest(items, stage);
    if (!found.nest)
      return emitError(found.at) << found.obstacle;
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

/// Cuts a loop whose iterations may be more than the block has threads, which
/// share each of its pieces.
LogicalResult GridBuilder::mapPieces(ParallelForOp loop, bool isOne) {
  if (updatesOwnPixels(loop))
    loop.emitRemark("what iterations keep across barriers is in memory: they "
                    "are not known to be at most ")
        << threads << ", the threads of a block";
  else
    loop.emitRemark("one thread does what iterations do between barriers: two "
                    "of them may update a pixel, in their order");
  if (failed(LoopSplitter(loop, memory.log).run()))
    return failure();
  launch.walk([&](scf::ForOp piece) {
    if (piece->removeAttr(marks::lanes) && !isOne &&
        chooseMapping(piece, threads) == ThreadMapping::Shared)
      piece->setAttr(marks::shared, UnitAttr::get(kernel.getContext()));
  });
  return success();
}

LogicalResult GridBuilder::mapLoop(ParallelLoopOpInterface loop) {
  ThreadMapping mapping = chooseMapping(loop, threads);
  bool isOne = loop->hasAttr(marks::one);
  if (isOne)
    mapping = mapping == ThreadMapping::Shared ? ThreadMapping::One
                                               : ThreadMapping::Pieces;
  bool isNested =
      loop->getParentOfType<ParallelLoopOpInterface>() || hasSharedParent(loop);
  if (isNested || mapping == ThreadMapping::One) {
    convertLoop(loop);
    launch.walk([](scf::ForOp made) { made->removeAttr(marks::lanes); });
    return success();
  }
  auto pixels = dyn_cast<ParallelPixelsOp>(*loop);
  auto numbered =
      pixels ? numberIterations(pixels) : cast<ParallelForOp>(*loop);
  if (mapping == ThreadMapping::Pieces)
    return mapPieces(numbered, isOne);
  if (mapping == ThreadMapping::Threads)
    return success(); // BlockMapping.cpp does the rest
  convertLoop(numbered);
  launch.walk([&](scf::ForOp made) {
    if (made->removeAttr(marks::lanes))
      made->setAttr(marks::shared, UnitAttr::get(kernel.getContext()));
  });
  return success();
}

/// Does what piko-map-lanes says. Where lanes would have items whose updates
/// have to be put in order, they share the iterations of one, if others than
/// rare primitives have any; where they would have pairs, they have items if
/// these need no order.
void GridBuilder::obeyLanes() {
  auto yes = UnitAttr::get(kernel.getContext());
  auto keepToOne = [&](Operation *work) {
    work->walk(
        [&](ParallelLoopOpInterface loop) { loop->setAttr(marks::one, yes); });
  };
  kernel.walk([&](ItemsOp work) {
    LaneMapping lanes = work.getLanes().value_or(LaneMapping::Items);
    if (lanes == LaneMapping::One)
      keepToOne(work);
    else if ((lanes != LaneMapping::Iterations ||
              hasRareIterationsOnly(work)) &&
             chooseMapping(work, threads) == ThreadMapping::Shared)
      work->setAttr(marks::shared, yes);
  });
  kernel.walk([&](ListsOp work) {
    if (work.getLanes() == LaneMapping::One)
      keepToOne(work);
  });
}

LogicalResult GridBuilder::mapWork() {
  obeyLanes();
  formGrid();
  launch.walk([](scf::ForOp loop) { loop->removeAttr(marks::lanes); });
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
    deferWork(loop, memory, threads);
  std::optional<GridMemory> rest;
  bool hasRare = false;
  // What a launch leaves is for the kernel itself.
  if (kernel.getPrecedes())
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
    memory.keepOutboxesInBlock(threads);
  return success();
}

/// On a copy, which takes the kernel's place where it comes out; otherwise says
/// why not.
std::optional<Obstacle> ConvertPikoToGPUPass::tryToSharePixels(KernelOp kernel,
                                                               StageOp stage,
                                                               int64_t count,
                                                               bool collapses) {
  OpBuilder builder(kernel);
  auto copy = cast<KernelOp>(builder.clone(*kernel));
  Obstacle obstacle{kernel.getLoc(), ""};
  LogicalResult result = [&] {
    ScopedDiagnosticHandler handler(&getContext(), [&](Diagnostic &error) {
      obstacle = {error.getLocation(), error.str()};
      return success();
    });
    return GridBuilder(copy, stage, count).sharePixelsOfBins(collapses);
  }();
  if (failed(result)) {
    copy.erase();
    return obstacle;
  }
  kernel.erase();
  return std::nullopt;
}

/// Threads share the pixels of many primitives, or else of one after the other.
bool ConvertPikoToGPUPass::sharePixels(KernelOp kernel, StageOp stage,
                                       int64_t count) {
  bool isOne = contains(kernel, [](Operation *op) {
    auto items = dyn_cast<ItemsOp>(op);
    return items && items.getLanes() == LaneMapping::One;
  });
  if (isOne || !canSharePixels(kernel))
    return false;
  std::optional<Obstacle> few = Obstacle{kernel.getLoc(), ""};
  if (count > 1)
    few = tryToSharePixels(kernel, stage, count, /*collapses=*/true);
  if (!few)
    return true;
  auto none = tryToSharePixels(kernel, stage, count, /*collapses=*/false);
  if (none && !none->text.empty())
    emitRemark(none->at, "the threads of a block do not share pixels: ")
        << none->text;
  else if (!none && !few->text.empty())
    emitRemark(few->at, "the threads of a block take one primitive after the "
                        "other: ")
        << few->text;
  return !none;
}

/// As many as the stage has, but not much fewer than a bin has pixels: a device
/// has few blocks then, and each of them takes long.
static int64_t chooseThreads(StageOp stage) {
  constexpr uint64_t pixelsOfThread = 16, most = 256;
  uint64_t pixels = 1, threads = stage.getThreads();
  for (int64_t size : stage.getBins())
    pixels = llvm::SaturatingMultiply<uint64_t>(pixels, size);
  threads = std::max(threads, std::min(pixels / pixelsOfThread, most));
  return std::min<int64_t>(maxThreads, llvm::bit_floor(threads));
}

LogicalResult ConvertPikoToGPUPass::convert(KernelOp kernel) {
  Operation *work = findWork(kernel);
  if (!work) {
    if (kernel.getOps<BeginScheduleOp>().empty())
      return kernel.emitOpError(
          "expected work on bins, as piko-form-work makes it");
    return success();
  }
  auto stage = lookupInPipeline<StageOp>(kernel, getStageName(work));
  int64_t count = threads ? threads : chooseThreads(stage);
  expandRemainders(kernel);
  if (failed(checkGridLimits(kernel)))
    return failure();
  if (sharePixels(kernel, stage, count))
    return success();
  return GridBuilder(kernel, stage, count).mapWork();
}

void ConvertPikoToGPUPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  if (threads < 0 || threads > maxThreads ||
      (threads && !llvm::isPowerOf2_64(threads))) {
    pipeline.emitError("expected a power of two up to ")
        << maxThreads << " for the threads of a block, but got "
        << threads.getValue();
    return signalPassFailure();
  }
  for (auto kernel : llvm::to_vector(pipeline.getOps<KernelOp>()))
    if (failed(convert(kernel)))
      return signalPassFailure();
  auto kernels = llvm::to_vector(pipeline.getOps<KernelOp>());
  for (KernelOp kernel : llvm::reverse(kernels))
    if (FlatSymbolRefAttr next = kernel.getPrecedesAttr())
      launchInFrontOf(lookupInPipeline<KernelOp>(kernel, next), kernel);
}
