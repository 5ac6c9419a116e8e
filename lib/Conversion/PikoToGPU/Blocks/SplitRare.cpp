// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-split-rare: in loops over primitives that threads share, a rare branch
// (RareBranches.cpp) becomes a region of its own, which piko-outline-rare-work
// makes a function of. What a kernel with such a call keeps across it costs
// registers where there is no rare primitive, too. So it has two launches:
//   1. rounds of primitives up to the first one with a rare primitive, where
//      the block leaves the unit (piko.gpu.leave_round). No call;
//   2. for units of which something was left, rounds from there on, with calls.
// That holds where all that the usual way does is to emit: anything else would
// be done twice. Emissions keep their order: the second launch's directories
// come after those of the first.

#include "PikoToGPU/Grid/GridMemory.h"
#include "PikoToGPU/Mapping/RareBranches.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/IR/IRMapping.h"

namespace piko {
#define GEN_PASS_DEF_SPLITRARE
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct SplitRarePass : piko::impl::SplitRareBase<SplitRarePass> {
  using SplitRareBase::SplitRareBase;
  void runOnOperation() override;
};

} // namespace

//===----------------------------------------------------------------------===//
// Branches
//===----------------------------------------------------------------------===//

/// Makes regions of their own of a loop's rare branches; how many.
static int64_t setRareBranchesApart(scf::ForOp loop) {
  SmallVector<Region *> rare = findRareWays(loop);
  for (Region *way : rare) {
    Block &block = way->front();
    OpBuilder builder(block.getTerminator());
    Location loc = way->getParentOp()->getLoc();
    auto apart = scf::ExecuteRegionOp::create(builder, loc, TypeRange(),
                                              /*no_inline=*/true);
    apart->setAttr(marks::rare, builder.getUnitAttr());
    Block *inside = builder.createBlock(&apart.getRegion());
    inside->getOperations().splice(inside->end(), block.getOperations(),
                                   block.begin(), apart->getIterator());
    scf::YieldOp::create(builder, loc);
  }
  return rare.size();
}

//===----------------------------------------------------------------------===//
// Launches
//===----------------------------------------------------------------------===//

/// Whether doing it twice would show, but for what is emitted.
static bool showsTwice(Operation *op) {
  auto access = dyn_cast<StateAccessOpInterface>(op);
  return (access && access.getAccessKinds() != StateAccess::reads) ||
         isa<AllocateOp, ScratchOp>(op);
}

static SmallVector<scf::ExecuteRegionOp> findRare(Operation *loop) {
  SmallVector<scf::ExecuteRegionOp> rare;
  loop->walk([&](scf::ExecuteRegionOp apart) {
    if (apart->hasAttr(marks::rare))
      rare.push_back(apart);
  });
  return rare;
}

/// The loop over buckets around a loop over primitives that are stored.
static scf::ForOp getBuckets(scf::ForOp loop, gpu::LaunchOp launch) {
  auto buckets = dyn_cast<scf::ForOp>(loop->getParentOp());
  bool isIt = buckets && buckets->getParentOp() == launch &&
              buckets.getUpperBound().getDefiningOp<UnitBucketsOp>();
  return isIt ? buckets : scf::ForOp();
}

/// Whether a loop emits to work in the same bin alone, and tells no positions.
static bool emitsLocally(scf::ForOp loop, GridMemory &memory) {
  return !contains(loop, [&](Operation *op) {
    auto append = dyn_cast<AppendOp>(op);
    return isa<NextOp>(op) || (append && (append.getWriter() != memory.log ||
                                          !memory.isLocal(append.getPort())));
  });
}

static bool canLeave(scf::ForOp loop, GridMemory &memory) {
  scf::ForOp buckets = getBuckets(loop, memory.launch);
  if (!buckets || contains(memory.launch, llvm::IsaPred<DrainOp>))
    return false;
  SmallVector<scf::ExecuteRegionOp> rare = findRare(loop);
  if (rare.empty() || llvm::any_of(rare, [](scf::ExecuteRegionOp apart) {
        return apart->getNumResults() != 0;
      }))
    return false;
  auto isRare = [&](Operation *op) {
    return llvm::any_of(rare, [&](scf::ExecuteRegionOp apart) {
      return apart->isProperAncestor(op);
    });
  };
  for (Operation &op : *buckets.getBody())
    if (&op != loop && !isa<LocalBinOp>(op) &&
        contains(&op, [](Operation *inner) {
          return showsTwice(inner) || isa<AppendOp, NextOp>(inner);
        }))
      return false;
  return !contains(loop, [&](Operation *op) {
    return showsTwice(op) && !isRare(op);
  }) && (memory.locals.empty() || emitsLocally(loop, memory));
}

/// Puts a second launch after the grid's, for units in which the loop comes to
/// rare primitives.
static void leaveRareRounds(scf::ForOp loop, gpu::LaunchOp first) {
  OpBuilder builder(first);
  builder.setInsertionPointAfter(first);
  IRMapping copies;
  auto rest = cast<gpu::LaunchOp>(builder.clone(*first, copies));
  StringRef name = first.getFunctionAttr().getLeafReference();
  rest.setFunctionAttr(
      FlatSymbolRefAttr::get(builder.getContext(), (name + "_rest").str()));
  rest->setAttr(marks::rest, builder.getUnitAttr());
  copies.lookup(loop.getOperation())
      ->setAttr(marks::rest, builder.getUnitAttr());
  for (scf::ExecuteRegionOp apart : findRare(loop)) {
    builder.setInsertionPoint(apart);
    LeaveRoundOp::create(builder, apart.getLoc());
    apart.erase();
  }
}

/// Threads have their append buffers in shared memory then, as are the counters
/// of units and buckets.
static void spareRegisters(gpu::LaunchOp launch) {
  for (StringRef mark : {marks::blockCounters, marks::blockBuffers})
    launch->setAttr(mark, UnitAttr::get(launch.getContext()));
}

static void splitRare(GridMemory &memory) {
  gpu::LaunchOp launch = memory.launch;
  bool hasRest = false;
  for (scf::ForOp loop : collect<scf::ForOp>(launch)) {
    if (!loop->hasAttr(marks::shared) || setRareBranchesApart(loop) == 0)
      continue;
    spareRegisters(launch);
    if (hasRest || !canLeave(loop, memory))
      continue;
    leaveRareRounds(loop, launch);
    hasRest = true;
  }
}

void SplitRarePass::runOnOperation() {
  FailureOr<SmallVector<GridMemory>> grids = findGrids(getOperation());
  if (failed(grids))
    return signalPassFailure();
  for (GridMemory &memory : *grids) {
    // What a launch leaves is for the kernel itself.
    if (!memory.launch->getParentOfType<KernelOp>().getPrecedes())
      splitRare(memory);
  }
}
