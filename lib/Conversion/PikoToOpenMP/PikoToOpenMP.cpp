// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-piko-to-openmp: units of work over threads.

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/OpenMP/OpenMPDialect.h"
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

/// A loop over units as threads share it.
class UnitSharing {
public:
  UnitSharing(scf::ForallOp forall, PatternRewriter &rewriter)
      : forall(forall), loc(forall.getLoc()), rewriter(rewriter) {}

  /// Finds what the units are of.
  LogicalResult findBins() {
    auto count = forall.getMixedUpperBound()
                     .front()
                     .dyn_cast<Value>()
                     .getDefiningOp<UnitCountOp>();
    if (count)
      bins = count.getBins();
    return success(bool(count));
  }

  void convert(UnitLoop kind) {
    zero = arith::ConstantIndexOp::create(rewriter, loc, 0);
    one = arith::ConstantIndexOp::create(rewriter, loc, 1);
    count = forall.getUpperBound(rewriter).front();
    if (kind == UnitLoop::Serial) {
      hoistPrivateArrays(forall, rewriter);
      moveBody(createLoop().getBody());
      return;
    }
    // Without units there may be nothing to take them from.
    any = arith::CmpIOp::create(rewriter, loc, arith::CmpIPredicate::ne, count,
                                zero);
    omp::ParallelOperands clauses;
    clauses.numThreads = ThreadsOp::create(rewriter, loc);
    auto parallel = omp::ParallelOp::create(rewriter, loc, clauses);
    rewriter.createBlock(&parallel.getRegion());
    rewriter.setInsertionPoint(omp::TerminatorOp::create(rewriter, loc));
    hoistPrivateArrays(forall, rewriter);
    share(kind);
  }

private:
  scf::ForOp createLoop() {
    return scf::ForOp::create(rewriter, loc, zero, count, one);
  }

  /// Moves the body before the terminator of `to`, whose argument is the
  /// unit.
  void moveBody(Block *to) {
    rewriter.eraseOp(forall.getTerminator());
    rewriter.inlineBlockBefore(forall.getBody(), to,
                               to->getTerminator()->getIterator(),
                               to->getArgument(0));
  }

  Value isUnit(Value number) {
    return arith::CmpIOp::create(rewriter, loc, arith::CmpIPredicate::ult,
                                 number, count);
  }

  /// Each thread runs one unit after the other.
  void share(UnitLoop kind) {
    auto some = scf::IfOp::create(rewriter, loc, any, /*withElse=*/false);
    rewriter.setInsertionPointToStart(some.thenBlock());
    if (kind == UnitLoop::Mapped)
      return shareMapped();
    Type index = rewriter.getIndexType();
    auto loop = scf::WhileOp::create(rewriter, loc, TypeRange(index), {});
    rewriter.createBlock(&loop.getBefore());
    Value next = kind == UnitLoop::Asked
                     ? NextUnitOp::create(rewriter, loc, bins).getResult()
                     : TakeUnitOp::create(rewriter, loc, bins, /*thread=*/{})
                           .getResult();
    // At the end -1, or the count or more.
    scf::ConditionOp::create(rewriter, loc, isUnit(next), next);
    Block *run = rewriter.createBlock(&loop.getAfter(), {}, index, loc);
    scf::YieldOp::create(rewriter, loc);
    moveBody(run);
  }

  /// First those of its own, as long as there are any; then it helps others, as
  /// the runtime says.
  void shareMapped() {
    Type index = rewriter.getIndexType(), truth = rewriter.getI1Type();
    Value thread = ThreadOp::create(rewriter, loc);
    Value yes = arith::ConstantIntOp::create(rewriter, loc, truth, 1);
    auto loop =
        scf::WhileOp::create(rewriter, loc, TypeRange{index, truth}, yes);
    Block *before = rewriter.createBlock(&loop.getBefore(), {}, truth, loc);
    auto own = scf::IfOp::create(
        rewriter, loc, before->getArgument(0),
        [&](OpBuilder &builder, Location loc) {
          scf::YieldOp::create(
              builder, loc,
              TakeUnitOp::create(builder, loc, bins, thread).getResult());
        },
        [&](OpBuilder &builder, Location loc) {
          Value none = arith::ConstantIndexOp::create(builder, loc, -1);
          scf::YieldOp::create(builder, loc, none);
        });
    Value isOwn = isUnit(own.getResult(0));
    auto next = scf::IfOp::create(
        rewriter, loc, isOwn,
        [&](OpBuilder &builder, Location loc) {
          scf::YieldOp::create(builder, loc, own.getResult(0));
        },
        [&](OpBuilder &builder, Location loc) {
          scf::YieldOp::create(
              builder, loc, NextUnitOp::create(builder, loc, bins).getResult());
        });
    scf::ConditionOp::create(rewriter, loc, isUnit(next.getResult(0)),
                             ValueRange{next.getResult(0), isOwn});
    Block *run =
        rewriter.createBlock(&loop.getAfter(), {}, {index, truth}, {loc, loc});
    scf::YieldOp::create(rewriter, loc, run->getArgument(1));
    moveBody(run);
  }

  scf::ForallOp forall;
  Location loc;
  PatternRewriter &rewriter;
  Value bins, zero, one, count, any;
};

struct ConvertForall : OpRewritePattern<scf::ForallOp> {
  using OpRewritePattern::OpRewritePattern;

  LogicalResult matchAndRewrite(scf::ForallOp forall,
                                PatternRewriter &rewriter) const override {
    auto kind = forall->getAttrOfType<UnitLoopAttr>(marks::units);
    if (!kind || forall.getRank() != 1 || !forall.isNormalized())
      return rewriter.notifyMatchFailure(forall, "not the loop of a kernel");
    UnitSharing sharing(forall, rewriter);
    if (failed(sharing.findBins()))
      return rewriter.notifyMatchFailure(forall, "not a loop over units");
    sharing.convert(kind.getValue());
    rewriter.eraseOp(forall);
    return success();
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
