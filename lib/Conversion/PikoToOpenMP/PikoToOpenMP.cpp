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

  /// The unit that a thread runs next, by what is known of who runs which; no
  /// number below the count at the end.
  Value createNext(UnitLoop kind, Value thread) {
    if (kind == UnitLoop::Asked)
      return NextUnitOp::create(rewriter, loc, bins);
    Value taken = TakeUnitOp::create(rewriter, loc, bins, thread);
    if (kind == UnitLoop::Shared)
      return taken;
    // Who has no more helps others, which the runtime sees to.
    Value own = arith::CmpIOp::create(rewriter, loc, arith::CmpIPredicate::ult,
                                      taken, count);
    return scf::IfOp::create(
               rewriter, loc, own,
               [&](OpBuilder &builder, Location loc) {
                 scf::YieldOp::create(builder, loc, taken);
               },
               [&](OpBuilder &builder, Location loc) {
                 scf::YieldOp::create(
                     builder, loc,
                     NextUnitOp::create(builder, loc, bins).getResult());
               })
        .getResult(0);
  }

  /// Each thread runs one unit after the other.
  void share(UnitLoop kind) {
    auto some = scf::IfOp::create(rewriter, loc, any, /*withElse=*/false);
    rewriter.setInsertionPointToStart(some.thenBlock());
    Value thread;
    if (kind == UnitLoop::Mapped)
      thread = ThreadOp::create(rewriter, loc);
    auto loop = scf::WhileOp::create(rewriter, loc,
                                     TypeRange(rewriter.getIndexType()), {});
    rewriter.createBlock(&loop.getBefore());
    Value next = createNext(kind, thread);
    Value goesOn = arith::CmpIOp::create(
        rewriter, loc, arith::CmpIPredicate::ult, next, count);
    scf::ConditionOp::create(rewriter, loc, goesOn, next);
    Block *run = rewriter.createBlock(&loop.getAfter(), {},
                                      rewriter.getIndexType(), loc);
    scf::YieldOp::create(rewriter, loc);
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
