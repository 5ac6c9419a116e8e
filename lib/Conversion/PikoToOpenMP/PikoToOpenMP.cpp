// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-piko-to-openmp: units of work over threads.

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Transforms/GreedyPatternRewriteDriver.h"

namespace piko {
#define GEN_PASS_DEF_CONVERTPIKOTOOPENMP
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

/// Moves private arrays to where `builder` stands: an alloca in a loop would
/// take more of the stack each time around.
static void hoistPrivateArrays(Operation *root, OpBuilder &builder) {
  SmallVector<memref::AllocaOp> arrays;
  root->walk([&](memref::AllocaOp array) {
    if (array.getDynamicSizes().empty() && array.getSymbolOperands().empty())
      arrays.push_back(array);
  });
  for (memref::AllocaOp array : arrays)
    array->moveBefore(builder.getInsertionBlock(), builder.getInsertionPoint());
}

namespace {

struct ConvertForall : OpRewritePattern<scf::ForallOp> {
  using OpRewritePattern::OpRewritePattern;

  LogicalResult matchAndRewrite(scf::ForallOp forall,
                                PatternRewriter &rewriter) const override {
    auto name = forall->getAttrOfType<StringAttr>("piko.schedule");
    std::optional<ScheduleKind> kind =
        name ? symbolizeScheduleKind(name.getValue()) : std::nullopt;
    if (!kind || forall.getRank() != 1 || !forall.isNormalized())
      return rewriter.notifyMatchFailure(forall, "not the loop of a kernel");
    Location loc = forall.getLoc();
    Value zero = arith::ConstantIndexOp::create(rewriter, loc, 0);
    Value one = arith::ConstantIndexOp::create(rewriter, loc, 1);
    Value count = forall.getUpperBound(rewriter).front();
    if (*kind == ScheduleKind::Serialize) {
      hoistPrivateArrays(forall, rewriter);
      auto loop = scf::ForOp::create(rewriter, loc, zero, count, one);
      moveBody(forall, loop.getBody(),
               loop.getBody()->getTerminator()->getIterator(),
               loop.getInductionVar(), rewriter);
    } else {
      createParallel(forall, *kind, zero, count, one, rewriter);
    }
    rewriter.eraseOp(forall);
    return success();
  }

private:
  static void moveBody(scf::ForallOp forall, Block *to, Block::iterator before,
                       Value unit, PatternRewriter &rewriter) {
    rewriter.eraseOp(forall.getTerminator());
    rewriter.inlineBlockBefore(forall.getBody(), to, before, unit);
  }

  static void createParallel(scf::ForallOp forall, ScheduleKind kind,
                             Value zero, Value count, Value one,
                             PatternRewriter &rewriter) {
    Location loc = forall.getLoc();
    omp::ParallelOperands parallelClauses;
    Value threads = ThreadsOp::create(rewriter, loc);
    parallelClauses.numThreads = threads;
    auto parallel = omp::ParallelOp::create(rewriter, loc, parallelClauses);
    rewriter.createBlock(&parallel.getRegion());
    rewriter.setInsertionPoint(omp::TerminatorOp::create(rewriter, loc));
    hoistPrivateArrays(forall, rewriter);

    omp::WsloopOperands loopClauses;
    loopClauses.scheduleKind = omp::ClauseScheduleKindAttr::get(
        rewriter.getContext(), kind == ScheduleKind::DirectMap
                                   ? omp::ClauseScheduleKind::Static
                                   : omp::ClauseScheduleKind::Dynamic);
    auto wsloop = omp::WsloopOp::create(rewriter, loc, loopClauses);
    rewriter.createBlock(&wsloop.getRegion());
    omp::LoopNestOperands bounds;
    bounds.loopLowerBounds.push_back(zero);
    bounds.loopUpperBounds.push_back(count);
    bounds.loopSteps.push_back(one);
    auto nest = omp::LoopNestOp::create(rewriter, loc, bounds);
    Block *body = rewriter.createBlock(&nest.getRegion(), {},
                                       rewriter.getIndexType(), loc);
    auto yield = omp::YieldOp::create(rewriter, loc, ValueRange());
    moveBody(forall, body, yield->getIterator(), body->getArgument(0),
             rewriter);
  }
};

struct ConvertPikoToOpenMPPass
    : piko::impl::ConvertPikoToOpenMPBase<ConvertPikoToOpenMPPass> {
  void runOnOperation() override {
    RewritePatternSet patterns(&getContext());
    populatePikoToOpenMPPatterns(patterns);
    if (failed(applyPatternsGreedily(getOperation(), std::move(patterns))))
      return signalPassFailure();
  }
};

} // namespace

void piko::populatePikoToOpenMPPatterns(RewritePatternSet &patterns) {
  patterns.add<ConvertForall>(patterns.getContext());
}
