// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-piko-to-scf: updates and other access to state, under tests of where
// they go.

#include "PikoToSCF/Tiles.h"

#include "Piko/Transforms/Storage/PixelAccess.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/IR/Matchers.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Transforms/GreedyPatternRewriteDriver.h"

namespace piko {
#define GEN_PASS_DEF_CONVERTPIKOTOSCF
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

static SmallVector<Value> toIndices(BinArithmetic &bins, ValueRange values) {
  return llvm::map_to_vector(values, [&](Value v) { return bins.toIndex(v); });
}

namespace {

struct ConvertUpdate : OpRewritePattern<UpdateOp> {
  using OpRewritePattern::OpRewritePattern;

  LogicalResult matchAndRewrite(UpdateOp update,
                                PatternRewriter &rewriter) const override {
    StageOp stage = getKernelStage(update);
    if (!stage || !update.getBin())
      return rewriter.notifyMatchFailure(update, "not in a kernel of loops");
    PixelAccess pixel(update);
    scf::IfOp test = pixel.createTest(rewriter, update.getResultTypes());
    convertBody(update, pixel, test, rewriter);
    rewriter.replaceOp(update, test);
    return success();
  }

private:
  /// Loads of the pixel, the body, stores of what it yields.
  static void convertBody(UpdateOp update, PixelAccess &pixel, scf::IfOp test,
                          PatternRewriter &rewriter) {
    auto yield = cast<YieldOp>(update.getBody().front().getTerminator());
    SmallVector<Value> oldValues = pixel.load(rewriter);
    Block *then = test.thenBlock();
    if (test.getNumResults() == 0)
      rewriter.setInsertionPoint(then->getTerminator());
    rewriter.inlineBlockBefore(&update.getBody().front(), then,
                               rewriter.getInsertionPoint(), oldValues);
    rewriter.setInsertionPoint(yield);
    for (auto [number, value] : llvm::enumerate(yield.getPixel()))
      if (value != oldValues[number])
        pixel.store(rewriter, number, value);
    if (test.getNumResults())
      scf::YieldOp::create(rewriter, update.getLoc(), yield.getResults());
    rewriter.eraseOp(yield);
  }
};

/// Puts an access that is not checked yet under a test of its indices; a read
/// that fails the test gives 0.
template <typename AccessOp> struct CheckAccess : OpRewritePattern<AccessOp> {
  using OpRewritePattern<AccessOp>::OpRewritePattern;

  LogicalResult matchAndRewrite(AccessOp access,
                                PatternRewriter &rewriter) const override {
    StageOp stage = getKernelStage(access);
    if (!stage)
      return rewriter.notifyMatchFailure(access, "not in a kernel of loops");
    if (access.getChecked() || access.getIndices().empty())
      return rewriter.notifyMatchFailure(access, "nothing to check");
    Location loc = access.getLoc();
    BinArithmetic bins(rewriter, loc, stage);
    SmallVector<Value> at = toIndices(bins, access.getIndices());
    TypeRange types = access->getResultTypes();
    auto ifOp = scf::IfOp::create(rewriter, loc, types,
                                  bins.isInState(access.getState(), at),
                                  /*withElseRegion=*/true);
    rewriter.setInsertionPointToStart(ifOp.elseBlock());
    FailOp::create(rewriter, loc, stage.getSymName(), access.getState(), at,
                   /*outside_bin=*/false,
                   isInAssign(access) ? Value() : findBin(rewriter, access),
                   access.getOfAttr());
    rewriter.setInsertionPointToStart(ifOp.thenBlock());
    auto checked = cast<AccessOp>(rewriter.clone(*access));
    checked.setChecked(true);
    checked.removeOfAttr(); // so that equal reads are the same
    if (!types.empty()) {
      scf::YieldOp::create(rewriter, loc, checked->getResults());
      rewriter.setInsertionPointToEnd(ifOp.elseBlock());
      Value zero = arith::ConstantOp::create(
          rewriter, loc, rewriter.getZeroAttr(types.front()));
      scf::YieldOp::create(rewriter, loc, zero);
    }
    rewriter.replaceOp(access, ifOp);
    return success();
  }

private:
  static bool isInAssign(Operation *access) {
    auto load = dyn_cast<LoadOp>(access);
    return load && load.getAssign();
  }
};

/// Puts an integer division under a test of whether it has a result.
struct ConvertDivide : OpRewritePattern<DivideOp> {
  using OpRewritePattern::OpRewritePattern;

  LogicalResult matchAndRewrite(DivideOp divide,
                                PatternRewriter &rewriter) const override {
    StageOp stage = getKernelStage(divide);
    BeginScheduleOp schedule = findSchedule(divide);
    if (!stage && !schedule)
      return rewriter.notifyMatchFailure(divide, "not in a kernel of loops");
    Location loc = divide.getLoc();
    Type type = divide.getType();
    Value zero =
        arith::ConstantOp::create(rewriter, loc, rewriter.getZeroAttr(type));
    auto ifOp = scf::IfOp::create(rewriter, loc, type,
                                  createTest(divide, zero, rewriter),
                                  /*withElseRegion=*/true);
    rewriter.setInsertionPointToStart(ifOp.thenBlock());
    scf::YieldOp::create(rewriter, loc, divide.createUnchecked(rewriter));
    rewriter.setInsertionPointToStart(ifOp.elseBlock());
    Value bin;
    if (schedule)
      bin = findScheduledBin(divide, schedule);
    else if (!divide.getAssign())
      bin = findBin(rewriter, divide);
    FailDivideOp::create(rewriter, loc,
                         schedule ? schedule.getStage() : stage.getSymName(),
                         bin, divide.getOfAttr());
    scf::YieldOp::create(rewriter, loc, zero);
    rewriter.replaceOp(divide, ifOp);
    return success();
  }

private:
  /// The schedule whose body has become the kernel around.
  static BeginScheduleOp findSchedule(Operation *op) {
    if (auto kernel = op->getParentOfType<KernelOp>())
      for (auto schedule : kernel.getOps<BeginScheduleOp>())
        return schedule;
    return {};
  }

  static Value findScheduledBin(Operation *op, BeginScheduleOp schedule) {
    auto loop = op->getParentOfType<scf::ForOp>();
    while (loop && loop.getUpperBound() != schedule.getBins())
      loop = loop->getParentOfType<scf::ForOp>();
    return loop ? loop.getInductionVar() : Value();
  }

  static Value createTest(DivideOp divide, Value zero, OpBuilder &builder) {
    Location loc = divide.getLoc();
    using P = arith::CmpIPredicate;
    Value test =
        arith::CmpIOp::create(builder, loc, P::ne, divide.getRhs(), zero);
    if (!divide.isSigned())
      return test;
    auto type = cast<IntegerType>(divide.getType());
    auto constant = [&](const APInt &value) -> Value {
      return arith::ConstantOp::create(builder, loc,
                                       builder.getIntegerAttr(type, value));
    };
    unsigned bits = type.getWidth();
    Value fits = arith::OrIOp::create(
        builder, loc,
        arith::CmpIOp::create(builder, loc, P::ne, divide.getLhs(),
                              constant(APInt::getSignedMinValue(bits))),
        arith::CmpIOp::create(builder, loc, P::ne, divide.getRhs(),
                              constant(APInt::getAllOnes(bits))));
    return arith::AndIOp::create(builder, loc, test, fits);
  }
};

/// The end of a list less its beginning.
static Value createSize(PatternRewriter &rewriter, Location loc, ListOp list) {
  return arith::SubIOp::create(rewriter, loc, list.getEnd(), list.getBegin());
}

struct ConvertListSize : OpRewritePattern<ListSizeOp> {
  using OpRewritePattern::OpRewritePattern;

  LogicalResult matchAndRewrite(ListSizeOp size,
                                PatternRewriter &rewriter) const override {
    auto list = size.getList().getDefiningOp<ListOp>();
    if (!list)
      return rewriter.notifyMatchFailure(size, "not of a kernel's list");
    rewriter.replaceOp(size, createSize(rewriter, size.getLoc(), list));
    return success();
  }
};

/// Turns the read of a list into that of a position, under a test of the index
/// unless a loop says that it is inside.
struct ConvertListAt : OpRewritePattern<ListAtOp> {
  using OpRewritePattern::OpRewritePattern;

  LogicalResult matchAndRewrite(ListAtOp at,
                                PatternRewriter &rewriter) const override {
    auto list = at.getList().getDefiningOp<ListOp>();
    StageOp stage = getKernelStage(at);
    if (!list || !stage)
      return rewriter.notifyMatchFailure(at, "not of a kernel's list");
    Location loc = at.getLoc();
    Type type = at.getPrim().getType();
    auto createItem = [&] {
      Value position =
          arith::AddIOp::create(rewriter, loc, list.getBegin(), at.getIndex());
      return ItemOp::create(rewriter, loc, type, list.getBins(), position);
    };
    if (at.getChecked() || isLoopOver(at.getIndex(), list)) {
      rewriter.replaceOp(at, createItem());
      return success();
    }
    Value size = createSize(rewriter, loc, list);
    Value inside = arith::CmpIOp::create(
        rewriter, loc, arith::CmpIPredicate::ult, at.getIndex(), size);
    auto ifOp = scf::IfOp::create(rewriter, loc, type, inside,
                                  /*withElseRegion=*/true);
    rewriter.setInsertionPointToStart(ifOp.thenBlock());
    scf::YieldOp::create(rewriter, loc, createItem().getResult());
    rewriter.setInsertionPointToStart(ifOp.elseBlock());
    FailListOp::create(rewriter, loc, stage.getSymName(), at.getIndex(), size,
                       findBin(rewriter, at));
    scf::YieldOp::create(rewriter, loc,
                         NoItemOp::create(rewriter, loc, type).getResult());
    rewriter.replaceOp(at, ifOp);
    return success();
  }

private:
  /// Whether `index` counts from 0, or from above, to the size of `list`.
  static bool isLoopOver(Value index, ListOp list) {
    auto argument = dyn_cast<BlockArgument>(index);
    auto loop =
        argument
            ? dyn_cast_or_null<scf::ForOp>(argument.getOwner()->getParentOp())
            : scf::ForOp();
    APInt first;
    if (!loop || index != loop.getInductionVar() ||
        !matchPattern(loop.getLowerBound(), m_ConstantInt(&first)) ||
        first.isNegative())
      return false;
    Operation *bound = loop.getUpperBound().getDefiningOp();
    if (auto size = dyn_cast_or_null<ListSizeOp>(bound))
      return size.getList() == list;
    auto size = dyn_cast_or_null<arith::SubIOp>(bound);
    return size && size.getLhs() == list.getEnd() &&
           size.getRhs() == list.getBegin();
  }
};

struct ConvertPikoToSCFPass
    : piko::impl::ConvertPikoToSCFBase<ConvertPikoToSCFPass> {
  using ConvertPikoToSCFBase::ConvertPikoToSCFBase;
  /// LLVM branches where a second condition is chosen, and computes both where
  /// they are joined: of a rasterizer's bounds that took 8 % of a frame.
  static void restoreShortCircuits(PipelineOp pipeline) {
    SmallVector<Operation *> joined;
    pipeline.walk([&](Operation *op) {
      // Lanes do not branch.
      if (op->hasAttr(marks::shortCircuit) &&
          isa<arith::AndIOp, arith::OrIOp>(op) &&
          op->getResult(0).getType().isInteger(1))
        joined.push_back(op);
    });
    for (Operation *op : joined) {
      OpBuilder builder(op);
      Value first = op->getOperand(0), second = op->getOperand(1);
      bool isOr = isa<arith::OrIOp>(op);
      Value known = arith::ConstantOp::create(builder, op->getLoc(),
                                              builder.getBoolAttr(isOr));
      Value choice =
          arith::SelectOp::create(builder, op->getLoc(), first,
                                  isOr ? known : second, isOr ? second : known);
      op->getResult(0).replaceAllUsesWith(choice);
      op->erase();
    }
  }

  void runOnOperation() override {
    RewritePatternSet patterns(&getContext());
    populatePikoToSCFPatterns(patterns);
    if (failed(applyPatternsGreedily(getOperation(), std::move(patterns))))
      return signalPassFailure();
    if (failed(lowerTiles(getOperation(), privateTiles)))
      return signalPassFailure();
    restoreShortCircuits(getOperation());
    getOperation().walk([&](Operation *op) {
      if (isa<UpdateOp, ListAtOp, ListSizeOp>(op)) {
        op->emitOpError(
            "expected loops over units, as piko-form-units makes them");
        signalPassFailure();
      } else if (auto list = dyn_cast<ListOp>(op); list && list.use_empty()) {
        list.erase();
      }
    });
  }
};

} // namespace

void piko::populatePikoToSCFPatterns(RewritePatternSet &patterns) {
  patterns
      .add<ConvertUpdate, ConvertDivide, ConvertListAt, ConvertListSize,
           CheckAccess<AtomicOp>, CheckAccess<LoadOp>, CheckAccess<StoreOp>>(
          patterns.getContext());
}
