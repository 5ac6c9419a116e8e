// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-map-threads: for each kernel,
//   1. choose how many threads a block has;
//   2. where all that others see of it are pixels, let threads take the pixels
//      of many primitives (PixelNest.h), or else of one after the other
//      (PixelOwners.h). Before, loops that count become scf.for, numbers that
//      loops over pixels step become closed forms, and what pixels have in
//      common moves out of their loops;
//   3. otherwise say of each piece of work and each parallel loop who takes its
//      items or iterations (WorkLegality.h), and group updates whose pixels
//      follow from data (GroupUpdates.h).
// What mappings ask for:
//   collapsed  a primitive has one nest of loops over the pixels of a box, or
//              one pixel, which its setup finds, and the block needs at most
//              384 bytes of shared memory a thread;
//   pixels     all that has an effect follows from the update of a pixel;
//   shared     no two primitives, or iterations, update one pixel;
//   by_count   as shared, where primitives have parallel loops: the grid
//              chooses when it runs;
//   lockstep   iterations are at most as many as the threads.

#include "PikoToGPU/Mapping/GroupUpdates.h"
#include "PikoToGPU/Mapping/PixelOwners.h"
#include "PikoToGPU/Mapping/RareBranches.h"
#include "PikoToGPU/Mapping/SetupSplit.h"
#include "PikoToGPU/PikoToGPU.h"

#include "Piko/Analysis/Expectations.h"
#include "Piko/Analysis/IterationPixels.h"
#include "Piko/Conversion/UnitOrder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/SCF/Transforms/Transforms.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/IR/PatternMatch.h"
#include "llvm/Support/MathExtras.h"

namespace piko {
#define GEN_PASS_DEF_MAPTHREADS
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// What may be left out.
struct MappingOptions {
  bool collapses, groups, counts;
};

class ThreadMapper {
public:
  ThreadMapper(KernelOp kernel, StageOp stage, int64_t threads,
               MappingOptions options)
      : kernel(kernel), stage(stage), threads(threads), options(options) {}
  void run();

private:
  bool mapPixels();
  std::optional<Obstacle> findObstacleToCollapsing(ItemsOp items);
  void mapWork(WorkOpInterface work);
  int64_t countFewest(ItemsOp work);
  ThreadMapping chooseForItems(ItemsOp work);
  ThreadMapping chooseForLoop(ParallelLoopOpInterface loop);
  void orderUpdates(ParallelLoopOpInterface loop);
  void mark(Operation *op, ThreadMapping mapping) {
    op->setAttr(marks::threads,
                ThreadMappingAttr::get(kernel.getContext(), mapping));
  }

  KernelOp kernel;
  StageOp stage;
  int64_t threads;
  MappingOptions options;
};

struct MapThreadsPass : piko::impl::MapThreadsBase<MapThreadsPass> {
  using MapThreadsBase::MapThreadsBase;
  void runOnOperation() override;
};

} // namespace

//===----------------------------------------------------------------------===//
// Pixels
//===----------------------------------------------------------------------===//

/// The kernel's only work, if that is on the primitives of a bin.
static ItemsOp findOnlyItems(KernelOp kernel) {
  SmallVector<WorkOpInterface> works;
  kernel.walk([&](WorkOpInterface work) { works.push_back(work); });
  auto items = works.size() == 1 ? dyn_cast<ItemsOp>(*works.front()) : nullptr;
  return items && isa<BinsOp>(items->getParentOp()) ? items : nullptr;
}

/// Makes loops that count of those that C++ has. A number that is never used
/// becomes 0: it would be an argument of the kernel.
static void upliftLoops(KernelOp kernel) {
  IRRewriter rewriter(kernel.getContext());
  SmallVector<scf::WhileOp> loops;
  kernel.walk([&](scf::WhileOp loop) { loops.push_back(loop); });
  for (scf::WhileOp loop : loops) {
    rewriter.setInsertionPoint(loop);
    auto again = loop->getAttr(marks::probability);
    auto counted = scf::upliftWhileToForLoop(rewriter, loop);
    if (succeeded(counted) && again)
      (*counted)->setAttr(marks::probability, again);
  }
  SmallVector<ub::PoisonOp> unused;
  kernel.walk([&](ub::PoisonOp poison) { unused.push_back(poison); });
  for (ub::PoisonOp poison : unused) {
    rewriter.setInsertionPoint(poison);
    if (TypedAttr zero = rewriter.getZeroAttr(poison.getType()))
      rewriter.replaceOpWithNewOp<arith::ConstantOp>(poison, zero);
  }
}

std::optional<Obstacle> ThreadMapper::findObstacleToCollapsing(ItemsOp items) {
  if (threads == 1 || !options.collapses)
    return Obstacle{items.getLoc(), ""};
  PixelNestResult found = findPixelNest(items, stage);
  if (!found.nest)
    return found.obstacle;
  SetupSplit split(items, Extent::All, /*own=*/{}, found.nest->rare);
  PixelGroup group(threads, stage);
  if (!group.fits(split.countBytes()))
    return Obstacle{items.getLoc(),
                    "masks for the pixels of a bin take too much memory for a "
                    "block of " +
                        std::to_string(threads) + " threads"};
  return findObstacleToGroups(items, split, *found.nest, group);
}

/// Whether threads share the pixels of many primitives, or else of one after
/// the other.
bool ThreadMapper::mapPixels() {
  ItemsOp items = findOnlyItems(kernel);
  if (!items || items.getLanes() == LaneMapping::One ||
      !updatesPixelsAlone(kernel))
    return false;
  upliftLoops(kernel);
  useClosedFormsInPixelLoops(items);
  hoistOutOfPixelLoops(items);
  std::optional<Obstacle> many = findObstacleToCollapsing(items);
  if (!many) {
    mark(items, ThreadMapping::Collapsed);
    return true;
  }
  ThreadTile tile(threads, stage.getBins().size());
  if (auto each = findObstacleToSharing(items, tile)) {
    emitRemark(each->at, "the threads of a block do not share pixels: ")
        << each->text;
    return false;
  }
  if (!many->text.empty())
    emitRemark(many->at, "the threads of a block take one primitive after the "
                         "other: ")
        << many->text;
  mark(items, ThreadMapping::Pixels);
  return true;
}

//===----------------------------------------------------------------------===//
// Primitives and iterations
//===----------------------------------------------------------------------===//

/// From how many primitives on a block is done sooner if each of its threads
/// has some, be one of them as large as any: by operations.
int64_t ThreadMapper::countFewest(ItemsOp work) {
  constexpr int64_t barriers = 200;
  int64_t around = 0, each = 0, most = 1;
  work->walk([&](Operation *op) {
    (op->getParentOfType<ParallelLoopOpInterface>() ? each : around) += 1;
    if (auto loop = dyn_cast<ParallelLoopOpInterface>(op))
      most = std::max(
          most, std::min(expected::longestIterations, getMostIterations(loop)));
  });
  int64_t alone = around + each * most;
  int64_t shared =
      around + each * llvm::divideCeil(most, uint64_t(threads)) + barriers;
  return std::clamp<int64_t>(llvm::divideCeil(alone, uint64_t(shared)), 2,
                             threads);
}

/// Where lanes would share the iterations of one item, which others than rare
/// primitives have, threads have items where there are many; where lanes would
/// have pairs, threads have items if these need no order.
ThreadMapping ThreadMapper::chooseForItems(ItemsOp work) {
  LaneMapping lanes = work.getLanes().value_or(LaneMapping::Items);
  if (lanes == LaneMapping::One || threads == 1)
    return ThreadMapping::One;
  if (lanes == LaneMapping::Iterations && !hasRareIterationsOnly(work)) {
    if (!options.counts || !canShareByCount(work))
      return ThreadMapping::One;
    work->setAttr(marks::fewest,
                  Builder(work).getI64IntegerAttr(countFewest(work)));
    return ThreadMapping::ByCount;
  }
  return isIndependent(work) ? ThreadMapping::Shared : ThreadMapping::One;
}

/// Where two iterations may update one pixel.
void ThreadMapper::orderUpdates(ParallelLoopOpInterface loop) {
  if (threads == 1 || !options.groups || isChecked(loop) ||
      updatesOwnPixels(loop))
    return;
  std::optional<Obstacle> obstacle = findObstacleToGrouping(loop);
  if (!obstacle)
    groupUpdates(loop);
  else if (!obstacle->text.empty())
    emitRemark(obstacle->at,
               "one thread does what iterations do that may update "
               "a pixel of another one: ")
        << obstacle->text;
}

ThreadMapping ThreadMapper::chooseForLoop(ParallelLoopOpInterface loop) {
  orderUpdates(loop);
  if (!loop.hasBarriers())
    return isIndependent(loop) ? ThreadMapping::Shared : ThreadMapping::One;
  if (canRunInLockstep(loop, threads))
    return ThreadMapping::Lockstep;
  if (updatesOwnPixels(loop))
    loop.emitRemark("what iterations keep across barriers is in memory: they "
                    "are not known to be at most ")
        << threads << ", the threads of a block";
  return ThreadMapping::Pieces;
}

void ThreadMapper::mapWork(WorkOpInterface work) {
  auto items = dyn_cast<ItemsOp>(*work);
  ThreadMapping mapping = items ? chooseForItems(items) : ThreadMapping::One;
  mark(work, mapping);
  bool isOne = work.getLanes() == LaneMapping::One;
  work->walk([&](ParallelLoopOpInterface loop) {
    if (mapping == ThreadMapping::Shared ||
        loop->getParentOfType<ParallelLoopOpInterface>() ||
        (isOne && !loop.hasBarriers()))
      mark(loop, ThreadMapping::One);
    else
      mark(loop, isOne ? ThreadMapping::PiecesOfOne : chooseForLoop(loop));
  });
}

void ThreadMapper::run() {
  kernel->setAttr(marks::blockSize,
                  Builder(kernel.getContext()).getI64IntegerAttr(threads));
  if (!mapPixels())
    kernel.walk([&](WorkOpInterface work) { mapWork(work); });
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

/// Whether one block does all that is in a bin: a list, or what updates pixels.
static bool hasBlockForBin(KernelOp kernel) {
  bool isWhole = false;
  kernel.walk([&](WorkOpInterface work) {
    isWhole |= !isa<ItemsOp>(*work) || !isIndependent(work);
  });
  return isWhole;
}

/// As many as the stage has, but not much fewer than a bin has pixels: a device
/// has few blocks then, and each of them takes long.
static int64_t chooseThreads(StageOp stage, KernelOp kernel) {
  constexpr uint64_t pixelsOfThread = 16, most = 256;
  uint64_t pixels = 1, threads = stage.getThreads();
  if (llvm::is_contained(stage.getBins(), 0) && hasBlockForBin(kernel))
    threads = std::max(threads, most); // the whole domain
  for (int64_t size : stage.getBins())
    pixels = llvm::SaturatingMultiply<uint64_t>(pixels, size);
  threads = std::max(threads, std::min(pixels / pixelsOfThread, most));
  return std::min<int64_t>(maxThreads, llvm::bit_floor(threads));
}

void MapThreadsPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  if (threads < 0 || threads > maxThreads ||
      (threads && !llvm::isPowerOf2_64(threads))) {
    pipeline.emitError("expected a power of two up to ")
        << maxThreads << " for the threads of a block, but got "
        << threads.getValue();
    return signalPassFailure();
  }
  for (auto kernel : pipeline.getOps<KernelOp>()) {
    Operation *work = findWork(kernel);
    if (!work)
      continue;
    auto stage = lookupInPipeline<StageOp>(kernel, getStageName(work));
    ThreadMapper(kernel, stage,
                 threads ? threads : chooseThreads(stage, kernel),
                 {collapses, groups, counts})
        .run();
  }
}
