// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-split-loops: parallel loops as loops over their iterations.

#include "Piko/Transforms/Storage/LoopSplitter.h"
#include "Piko/Transforms/Storage/ParallelLoops.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

namespace piko {
#define GEN_PASS_DEF_SPLITLOOPS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct SplitLoopsPass : piko::impl::SplitLoopsBase<SplitLoopsPass> {
  using SplitLoopsBase::SplitLoopsBase;
  void runOnOperation() override;
};
} // namespace

/// Whether an operation without operands gives the same value everywhere.
static bool isConstant(Operation *op) {
  if (op->getNumOperands() != 0 || op->getNumRegions() != 0 ||
      op->getNumResults() == 0)
    return false;
  if (auto load = dyn_cast<LoadOp>(op))
    return bool(lookupInPipeline<ConstantOp>(op, load.getStateAttr()));
  return isMemoryEffectFree(op) && isSpeculatable(op);
}

ParallelForOp piko::hoistInvariants(ParallelForOp parallel) {
  parallel.walk([&](Operation *op) {
    if (isConstant(op))
      op->moveBefore(parallel);
  });
  moveLoopInvariantCode(
      &parallel.getBody(),
      [&](Value value, Region *region) {
        return !region->isAncestor(value.getParentRegion());
      },
      [&](Operation *op, Region *) {
        return isMemoryEffectFree(op) && isSpeculatable(op);
      },
      [&](Operation *op, Region *) { op->moveBefore(parallel); });
  return parallel;
}

/// Iterations one after the other.
static scf::ForOp convertFor(ParallelForOp parallel) {
  IRRewriter rewriter(parallel);
  Location loc = parallel.getLoc();
  Value zero = arith::ConstantIndexOp::create(rewriter, loc, 0);
  Value one = arith::ConstantIndexOp::create(rewriter, loc, 1);
  auto loop = scf::ForOp::create(rewriter, loc, zero, parallel.getCount(), one);
  loop->setAttr(marks::lanes, rewriter.getUnitAttr());
  Block *body = parallel.getBodyBlock();
  rewriter.eraseOp(body->getTerminator());
  rewriter.inlineBlockBefore(body, loop.getBody()->getTerminator(),
                             loop.getInductionVar());
  rewriter.eraseOp(parallel);
  return loop;
}

/// The pixels of a box: rows from the last dimension on, x in the innermost
/// loop. What a row's pixels share stays out of it.
static scf::ForOp convertPixels(ParallelPixelsOp pixels) {
  IRRewriter rewriter(pixels);
  Location loc = pixels.getLoc();
  Value one = arith::ConstantIntOp::create(rewriter, loc, 1, /*width=*/32);
  scf::ForOp loop;
  SmallVector<Value> cell(pixels.getLo().size());
  for (unsigned dim = cell.size(); dim-- > 0;) {
    loop = scf::ForOp::create(rewriter, loc, pixels.getLo()[dim],
                              pixels.getHi()[dim], one);
    cell[dim] = loop.getInductionVar();
    rewriter.setInsertionPoint(loop.getBody()->getTerminator());
    if (dim > 0)
      loop->setAttr(marks::rows, rewriter.getUnitAttr());
  }
  loop->setAttr(marks::lanes, rewriter.getUnitAttr());
  Block *body = pixels.getBodyBlock();
  rewriter.eraseOp(body->getTerminator());
  rewriter.inlineBlockBefore(body, loop.getBody()->getTerminator(), cell);
  rewriter.eraseOp(pixels);
  if (cell.size() > 1)
    moveLoopInvariantCode(loop);
  return loop;
}

/// The same iterations by their numbers.
ParallelForOp piko::numberIterations(ParallelPixelsOp pixels) {
  IRRewriter rewriter(pixels);
  Location loc = pixels.getLoc();
  Type index = rewriter.getIndexType();
  Value count = arith::ConstantIndexOp::create(rewriter, loc, 1);
  Value none = arith::ConstantIndexOp::create(rewriter, loc, 0);
  SmallVector<Value> extents;
  for (auto [lo, hi] : llvm::zip(pixels.getLo(), pixels.getHi())) {
    Value first = arith::IndexCastOp::create(rewriter, loc, index, lo);
    Value end = arith::IndexCastOp::create(rewriter, loc, index, hi);
    Value extent = arith::SubIOp::create(rewriter, loc, end, first);
    extents.push_back(arith::MaxSIOp::create(rewriter, loc, extent, none));
    count = arith::MulIOp::create(rewriter, loc, count, extents.back());
  }
  auto parallel = ParallelForOp::create(rewriter, loc, count);
  Block *body = rewriter.createBlock(&parallel.getBody(), {}, index, loc);
  Value rest = parallel.getIteration();
  SmallVector<Value> cell;
  for (auto [lo, extent] : llvm::zip(pixels.getLo(), extents)) {
    Value offset = rest;
    if (cell.size() + 1 < extents.size()) {
      offset = arith::RemUIOp::create(rewriter, loc, rest, extent);
      rest = arith::DivUIOp::create(rewriter, loc, rest, extent);
    }
    offset = arith::IndexCastOp::create(rewriter, loc, lo.getType(), offset);
    cell.push_back(arith::AddIOp::create(rewriter, loc, lo, offset));
  }
  rewriter.mergeBlocks(pixels.getBodyBlock(), body, cell);
  rewriter.eraseOp(pixels);
  return parallel;
}

Value piko::createTripCount(OpBuilder &builder, scf::ForOp loop) {
  Location loc = loop.getLoc();
  Value lower = loop.getLowerBound(), upper = loop.getUpperBound();
  Value any =
      arith::CmpIOp::create(builder, loc,
                            loop.getUnsignedCmp() ? arith::CmpIPredicate::ult
                                                  : arith::CmpIPredicate::slt,
                            lower, upper);
  Value distance = arith::SubIOp::create(builder, loc, upper, lower);
  Value trips =
      arith::CeilDivUIOp::create(builder, loc, distance, loop.getStep());
  Value none = arith::ConstantOp::create(builder, loc,
                                         builder.getZeroAttr(trips.getType()));
  trips = arith::SelectOp::create(builder, loc, any, trips, none);
  if (trips.getType().isIndex())
    return trips;
  return arith::IndexCastUIOp::create(builder, loc, builder.getIndexType(),
                                      trips);
}

LogicalResult piko::checkParallelLoop(ParallelLoopOpInterface loop) {
  if (isa<ParallelForOp, ParallelPixelsOp>(*loop))
    return success();
  return loop->emitError("expected piko.parallel_for or piko.parallel_pixels, "
                         "of which other loops can be made, but got '")
         << loop->getName() << "'";
}

scf::ForOp piko::convertLoop(ParallelLoopOpInterface loop) {
  if (auto pixels = dyn_cast<ParallelPixelsOp>(*loop))
    return convertPixels(pixels);
  return convertFor(cast<ParallelForOp>(*loop));
}

/// Whether iterations may be the lanes of one vector, which have reductions,
/// scans and sorts.
static bool fitsLanes(ParallelForOp parallel, int64_t most) {
  std::optional<int64_t> count = getConstantIntValue(parallel.getCount());
  if (!count || *count < 2 || *count > most)
    return false;
  WalkResult result = parallel.walk([](BarrierOpInterface barrier) {
    return isa<SyncOp, ReduceOp, ScanOp, SortOp>(*barrier)
               ? WalkResult::advance()
               : WalkResult::interrupt();
  });
  return !result.wasInterrupted();
}

void SplitLoopsPass::runOnOperation() {
  // Those inside others first.
  SmallVector<ParallelLoopOpInterface> parallels;
  getOperation().walk([&](ParallelLoopOpInterface op) {
    if (op->getParentOfType<KernelOp>())
      parallels.push_back(op);
  });
  for (ParallelLoopOpInterface parallel : parallels)
    if (failed(checkParallelLoop(parallel)))
      return signalPassFailure();
  for (ParallelLoopOpInterface parallel : parallels) {
    if (!parallel.hasBarriers()) {
      convertLoop(parallel);
      continue;
    }
    if (auto loop = dyn_cast<ParallelForOp>(*parallel);
        loop && fitsLanes(loop, lockstep))
      continue;
    auto pixels = dyn_cast<ParallelPixelsOp>(*parallel);
    LoopSplitter splitter(pixels ? numberIterations(pixels)
                                 : cast<ParallelForOp>(*parallel));
    if (failed(splitter.run()))
      return signalPassFailure();
  }
}
