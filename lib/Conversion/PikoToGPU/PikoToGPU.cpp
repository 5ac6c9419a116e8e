// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-piko-to-gpu: for each kernel,
//   1. move the loop over units into a launch with a block for each unit;
//   2. if all that others see of it are pixels, share these among the block's
//      threads, and take primitives in groups, whose fields the block copies to
//      its memory;
//   3. otherwise map the block's work to its threads (BlockMapping.cpp);
//   4. convert access to state, and open a log for what the grid leaves.

#include "PikoToGPU.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"

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

/// Memory that the threads of a block share.
static Value addBlockMemory(gpu::LaunchOp launch, int64_t count, Type type) {
  auto space = gpu::AddressSpaceAttr::get(
      launch.getContext(), gpu::GPUDialect::getWorkgroupAddressSpace());
  return launch.addWorkgroupAttribution(
      MemRefType::get({count}, type, MemRefLayoutAttrInterface(), space),
      launch.getLoc());
}

namespace {

class GridBuilder {
public:
  GridBuilder(KernelOp kernel, StageOp stage, int64_t threads)
      : kernel(kernel), stage(stage), threads(threads), loc(kernel.getLoc()) {}

  /// Threads share the pixels of a bin; fails where they cannot.
  LogicalResult sharePixelsOfBins(SharingCounts &counts);
  /// Threads do what BlockMapping.cpp says.
  LogicalResult mapWork(int64_t &sharedLoops);

private:
  LogicalResult findUnits();
  LogicalResult findItems();
  void dropWriters();
  void createLaunch();
  void hoistPrivateArrays();
  void upliftLoops();
  ThreadTile createTile();
  void groupItems();
  LogicalResult convertAccess();
  /// The fields that are read by name alone, or none if they are too large.
  llvm::MapVector<StringAttr, SmallVector<GetOp>> collectFields(ItemOp item);

  KernelOp kernel;
  StageOp stage;
  int64_t threads;
  Location loc;
  OpenBinsOp bins;
  scf::ForallOp units;
  scf::ForOp items;
  gpu::LaunchOp launch;
  Value log;
};

struct ConvertPikoToGPUPass
    : piko::impl::ConvertPikoToGPUBase<ConvertPikoToGPUPass> {
  using ConvertPikoToGPUBase::ConvertPikoToGPUBase;
  void runOnOperation() override;
  LogicalResult convert(KernelOp kernel);
  bool tryToSharePixels(KernelOp kernel, StageOp stage, int64_t count);
};

} // namespace

LogicalResult GridBuilder::findUnits() {
  for (auto open : kernel.getOps<OpenBinsOp>())
    bins = open;
  for (auto loop : kernel.getOps<scf::ForallOp>())
    units = loop;
  if (!bins || !units)
    return kernel.emitOpError(
        "expected a loop over units, as piko-form-units makes it");
  return success();
}

LogicalResult GridBuilder::findItems() {
  units.walk([&](scf::ForOp loop) {
    if (loop->hasAttr("piko.lanes") && loop->getParentOfType<scf::ForOp>() &&
        !loop->getParentOfType<scf::ForOp>()->getParentOfType<scf::ForOp>())
      items = loop;
  });
  return success(items && !items.getNumResults() &&
                 !items.getBody()->getOps<ItemOp>().empty());
}

/// What is emitted goes to the grid's log; what emits nothing needs no
/// positions.
void GridBuilder::dropWriters() {
  bool emits = kernel
                   .walk([](Operation *op) {
                     return isa<AppendOp, AppendBinOp>(op)
                                ? WalkResult::interrupt()
                                : WalkResult::advance();
                   })
                   .wasInterrupted();
  SmallVector<Operation *> calls;
  launch.walk([&](Operation *op) {
    if (isa<CloseWriterOp>(op) || (isa<NextOp>(op) && !emits))
      calls.push_back(op);
  });
  for (Operation *op : calls)
    op->erase();
  for (auto open : llvm::to_vector(launch.getOps<OpenWriterOp>())) {
    open.replaceAllUsesWith(log);
    open.erase();
  }
}

void GridBuilder::createLaunch() {
  OpBuilder builder(units);
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  Value size = arith::ConstantIndexOp::create(builder, loc, threads);
  Value count = units.getUpperBound(builder).front();
  Value any = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ugt,
                                    count, zero);
  // A GPU refuses a grid without blocks.
  auto ifAny = scf::IfOp::create(builder, loc, any);
  builder.setInsertionPointToStart(ifAny.thenBlock());
  auto pipeline = kernel->getParentOfType<PipelineOp>();
  auto symbol = [&](const Twine &suffix) {
    return FlatSymbolRefAttr::get(builder.getContext(),
                                  (pipeline.getSymName() + suffix).str());
  };
  log = OpenLogOp::create(builder, loc, WriterType::get(builder.getContext()),
                          bins);
  launch = gpu::LaunchOp::create(
      builder, loc, count, one, one, size, one, one,
      /*dynamicSharedMemorySize=*/Value(), /*asyncTokenType=*/Type(),
      /*asyncDependencies=*/ValueRange(), /*workgroupAttributions=*/TypeRange(),
      /*privateAttributions=*/TypeRange(), Value(), Value(), Value(),
      symbol("_gpu"), symbol("_" + kernel.getSymName()));
  CloseLogOp::create(builder, loc, log);
  Block &body = launch.getBody().front();
  units.getTerminator()->erase();
  units.getInductionVar(0).replaceAllUsesWith(launch.getBlockIds().x);
  body.getOperations().splice(body.end(), units.getBody()->getOperations());
  units.erase();
  builder.setInsertionPointToEnd(&body);
  gpu::TerminatorOp::create(builder, loc);
  dropWriters();
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

llvm::MapVector<StringAttr, SmallVector<GetOp>>
GridBuilder::collectFields(ItemOp item) {
  llvm::MapVector<StringAttr, SmallVector<GetOp>> fields;
  for (Operation *user : item->getUsers())
    if (auto get = dyn_cast<GetOp>(user); get && get.getElements().empty())
      fields[get.getFieldAttr()].push_back(get);
  int64_t bytes = 0;
  for (auto &[name, gets] : fields)
    bytes += threads * llvm::divideCeil(
                           gets.front().getType().getIntOrFloatBitWidth(), 8);
  // Errors need eight bytes for each thread.
  if (bytes > maxBlockBytes - 8 * threads)
    fields.clear();
  return fields;
}

void GridBuilder::groupItems() {
  OpBuilder builder(items);
  Value begin = items.getLowerBound(), end = items.getUpperBound();
  Value thread = launch.getThreadIds().x;
  auto item = *items.getBody()->getOps<ItemOp>().begin();
  auto fields = collectFields(item);
  auto groups =
      scf::ForOp::create(builder, loc, begin, end, launch.getBlockSizeX());
  builder.setInsertionPointToStart(groups.getBody());
  Value base = groups.getInductionVar();

  if (!fields.empty()) {
    Value at = arith::AddIOp::create(builder, loc, base, thread);
    Value inside =
        arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt, at, end);
    auto copy = scf::IfOp::create(builder, loc, inside);
    OpBuilder body = copy.getThenBodyBuilder();
    Value prim =
        ItemOp::create(body, item.getLoc(), item.getType(), item.getBins(), at);
    for (auto &[name, gets] : fields) {
      Type type = gets.front().getType();
      Value memory = addBlockMemory(launch, threads, type);
      Value value = GetOp::create(body, gets.front().getLoc(), type, prim, name,
                                  ValueRange());
      memref::StoreOp::create(body, loc, value, memory, thread);
      for (GetOp get : gets) {
        OpBuilder here(get);
        Value copied = memref::LoadOp::create(here, get.getLoc(), memory,
                                              items.getInductionVar());
        get.replaceAllUsesWith(copied);
        get.erase();
      }
    }
    gpu::BarrierOp::create(builder, loc);
  }

  Value left = arith::SubIOp::create(builder, loc, end, base);
  Value count =
      arith::MinSIOp::create(builder, loc, left, launch.getBlockSizeX());
  items->moveBefore(groups.getBody()->getTerminator());
  items.setLowerBound(arith::ConstantIndexOp::create(builder, loc, 0));
  items.setUpperBound(count);
  if (!fields.empty()) {
    builder.setInsertionPoint(groups.getBody()->getTerminator());
    gpu::BarrierOp::create(builder, loc);
  }
  builder.setInsertionPoint(item);
  item.getPositionMutable().assign(
      arith::AddIOp::create(builder, loc, base, items.getInductionVar()));
}

LogicalResult GridBuilder::convertAccess() {
  RewritePatternSet patterns(kernel.getContext());
  populatePikoToSCFPatterns(patterns);
  return applyPatternsGreedily(
      kernel, std::move(patterns),
      GreedyRewriteConfig().enableFolding(false).setRegionSimplificationLevel(
          GreedySimplifyRegionLevel::Disabled));
}

LogicalResult GridBuilder::sharePixelsOfBins(SharingCounts &counts) {
  if (failed(findUnits()) || failed(findItems()))
    return failure();
  createLaunch();
  upliftLoops();
  if (failed(sharePixels(items, createTile(), counts)))
    return failure();
  hoistPrivateArrays();
  groupItems();
  OpBuilder builder = OpBuilder::atBlockBegin(&launch.getBody().front());
  Value order = memref::AllocaOp::create(
      builder, loc, MemRefType::get({4}, builder.getI64Type()));
  LogOrderOp::create(builder, loc, log, order);
  return convertAccess();
}

LogicalResult GridBuilder::mapWork(int64_t &sharedLoops) {
  if (failed(findUnits()))
    return failure();
  findSharedLoops(kernel);
  if (failed(convertAccess()))
    return failure();
  createLaunch();
  return mapBlock(launch, log, sharedLoops);
}

/// On a copy, which takes the kernel's place where it comes out.
bool ConvertPikoToGPUPass::tryToSharePixels(KernelOp kernel, StageOp stage,
                                            int64_t count) {
  if (!canSharePixels(kernel))
    return false;
  OpBuilder builder(kernel);
  auto copy = cast<KernelOp>(builder.clone(*kernel));
  SharingCounts counts;
  std::string obstacle;
  Location at = kernel.getLoc();
  LogicalResult result = [&] {
    ScopedDiagnosticHandler handler(&getContext(), [&](Diagnostic &error) {
      obstacle = error.str();
      at = error.getLocation();
      return success();
    });
    return GridBuilder(copy, stage, count).sharePixelsOfBins(counts);
  }();
  if (failed(result)) {
    copy.erase();
    if (!obstacle.empty())
      emitRemark(at, "the threads of a block do not share pixels: ")
          << obstacle;
    return false;
  }
  kernel.erase();
  strided += counts.strided;
  guarded += counts.guarded;
  return true;
}

LogicalResult ConvertPikoToGPUPass::convert(KernelOp kernel) {
  auto opened = kernel.getOps<OpenBinsOp>();
  if (opened.empty())
    return success(); // of a schedule
  auto stage =
      lookupInPipeline<StageOp>(kernel, (*opened.begin()).getStageAttr());
  int64_t count = threads;
  if (!count)
    count = std::min<int64_t>(maxThreads,
                              llvm::bit_floor(uint64_t(stage.getThreads())));
  if (failed(checkGridLimits(kernel)))
    return failure();
  ++grids;
  if (tryToSharePixels(kernel, stage, count))
    return success();
  int64_t loops = 0;
  if (failed(GridBuilder(kernel, stage, count).mapWork(loops)))
    return failure();
  shared += loops;
  return success();
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
}
