// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-normalize-loops: structured control flow that was made of branches tests
// more than it must. Until nothing changes,
//   1. truth values that are chosen or turned round become conjunctions,
//      disjunctions and opposite comparisons;
//   2. an scf.if whose first arm does nothing has its arms exchanged;
//   3. a flag that arms yield as a number becomes a truth value;
//   4. a truth value that one arm yields, where the other yields false, becomes
//      a conjunction before it;
//   5. an scf.if in another, where both yield the same otherwise, becomes one;
//   6. an scf.while whose work stands before its condition, in an scf.if
//      with that condition, has it after.

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Pass/PassManager.h"
#include "mlir/Transforms/GreedyPatternRewriteDriver.h"
#include "mlir/Transforms/Passes.h"

namespace piko {
#define GEN_PASS_DEF_NORMALIZELOOPS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct NormalizeLoopsPass : piko::impl::NormalizeLoopsBase<NormalizeLoopsPass> {
  void runOnOperation() override;
};

bool isEmpty(Region &arm) {
  return !arm.empty() && llvm::hasSingleElement(arm.front());
}

/// Whether the opposite of a condition is one of comparisons, too.
bool isInvertible(Value condition) {
  Operation *op = condition.getDefiningOp();
  return isa_and_nonnull<arith::CmpIOp>(op) ||
         (isa_and_nonnull<arith::AndIOp, arith::OrIOp>(op) &&
          isInvertible(op->getOperand(0)) && isInvertible(op->getOperand(1)));
}

Value invert(OpBuilder &builder, Value condition) {
  Operation *op = condition.getDefiningOp();
  Location loc = op->getLoc();
  if (auto compare = dyn_cast<arith::CmpIOp>(op))
    return arith::CmpIOp::create(builder, loc,
                                 arith::invertPredicate(compare.getPredicate()),
                                 compare.getLhs(), compare.getRhs());
  Value a = invert(builder, op->getOperand(0));
  Value b = invert(builder, op->getOperand(1));
  Operation *inverse;
  if (isa<arith::AndIOp>(op))
    inverse = arith::OrIOp::create(builder, loc, a, b);
  else
    inverse = arith::AndIOp::create(builder, loc, a, b);
  if (op->hasAttr(marks::shortCircuit))
    inverse->setAttr(marks::shortCircuit, builder.getUnitAttr());
  return inverse->getResult(0);
}

/// select %c, true, %d  =>  %c | %d, and select %c, %d, false  =>  %c & %d, of
/// comparisons. What is not needed need not be computed, as it was written.
struct JoinConditions : OpRewritePattern<arith::SelectOp> {
  using OpRewritePattern::OpRewritePattern;
  LogicalResult matchAndRewrite(arith::SelectOp choice,
                                PatternRewriter &rewriter) const override {
    Value condition = choice.getCondition();
    if (!choice.getType().isInteger(1) || !isInvertible(condition))
      return failure();
    if (matchPattern(choice.getTrueValue(), m_One()) &&
        isInvertible(choice.getFalseValue())) {
      rewriter
          .replaceOpWithNewOp<arith::OrIOp>(choice, condition,
                                            choice.getFalseValue())
          ->setAttr(marks::shortCircuit, rewriter.getUnitAttr());
      return success();
    }
    if (matchPattern(choice.getFalseValue(), m_Zero()) &&
        isInvertible(choice.getTrueValue())) {
      rewriter
          .replaceOpWithNewOp<arith::AndIOp>(choice, condition,
                                             choice.getTrueValue())
          ->setAttr(marks::shortCircuit, rewriter.getUnitAttr());
      return success();
    }
    return failure();
  }
};

/// !(a < b | c < d)  =>  a >= b & c >= d
struct InvertComparisons : OpRewritePattern<arith::XOrIOp> {
  using OpRewritePattern::OpRewritePattern;
  LogicalResult matchAndRewrite(arith::XOrIOp op,
                                PatternRewriter &rewriter) const override {
    if (!op.getType().isInteger(1) || !matchPattern(op.getRhs(), m_One()) ||
        !isInvertible(op.getLhs()))
      return failure();
    rewriter.replaceOp(op, invert(rewriter, op.getLhs()));
    return success();
  }
};

/// scf.if %c {} else { .. }  =>  scf.if !%c { .. }
struct ExchangeArms : OpRewritePattern<scf::IfOp> {
  using OpRewritePattern::OpRewritePattern;
  LogicalResult matchAndRewrite(scf::IfOp choice,
                                PatternRewriter &rewriter) const override {
    if (!isEmpty(choice.getThenRegion()) || choice.getElseRegion().empty() ||
        isEmpty(choice.getElseRegion()) || !isInvertible(choice.getCondition()))
      return failure();
    rewriter.setInsertionPoint(choice);
    Value opposite = invert(rewriter, choice.getCondition());
    rewriter.modifyOpInPlace(choice, [&] {
      choice.getConditionMutable().assign(opposite);
      setProbability(choice, getProbability(choice, choice.getElseRegion()));
      Block *first = choice.thenBlock(), *second = choice.elseBlock();
      choice.getThenRegion().getBlocks().splice(
          choice.getThenRegion().end(), choice.getElseRegion().getBlocks(),
          second->getIterator());
      first->moveBefore(&choice.getElseRegion(), choice.getElseRegion().end());
    });
    return success();
  }
};

/// What a number stands for that is a truth value in more bits; null if it is
/// another one.
Value asFlag(OpBuilder &builder, Value number) {
  if (auto extension = number.getDefiningOp<arith::ExtUIOp>())
    return extension.getIn().getType().isInteger(1) ? extension.getIn()
                                                    : Value();
  APInt constant;
  if (!matchPattern(number, m_ConstantInt(&constant)) || constant.ugt(1))
    return {};
  return arith::ConstantOp::create(
      builder, number.getLoc(),
      builder.getIntegerAttr(builder.getI1Type(), constant.getZExtValue()));
}

bool isFlag(Value number) {
  if (auto extension = number.getDefiningOp<arith::ExtUIOp>())
    return extension.getIn().getType().isInteger(1);
  APInt constant;
  return matchPattern(number, m_ConstantInt(&constant)) && constant.ule(1);
}

/// scf.index_switch of a truth value  =>  scf.if
struct TestFlags : OpRewritePattern<scf::IndexSwitchOp> {
  using OpRewritePattern::OpRewritePattern;
  LogicalResult matchAndRewrite(scf::IndexSwitchOp choice,
                                PatternRewriter &rewriter) const override {
    Value flag = getFlag(rewriter, choice.getArg());
    Region *yes = &choice.getDefaultRegion(), *no = yes;
    for (auto [value, region] :
         llvm::zip(choice.getCases(), choice.getCaseRegions()))
      if (value == 0 || value == 1)
        (value ? yes : no) = &region;
    if (!flag || yes == no)
      return failure();
    auto test = scf::IfOp::create(rewriter, choice.getLoc(),
                                  choice.getResultTypes(), flag,
                                  /*addThenBlock=*/false,
                                  /*addElseBlock=*/false);
    if (auto taken = getProbability(choice, *yes))
      if (double all = *taken + *getProbability(choice, *no); all > 0)
        setProbability(test, *taken / all);
    rewriter.inlineRegionBefore(*yes, test.getThenRegion(),
                                test.getThenRegion().end());
    rewriter.inlineRegionBefore(*no, test.getElseRegion(),
                                test.getElseRegion().end());
    rewriter.replaceOp(choice, test);
    return success();
  }

  /// The truth value that an index is, or null.
  static Value getFlag(OpBuilder &builder, Value index) {
    auto cast = index.getDefiningOp<arith::IndexCastUIOp>();
    if (!cast)
      return {};
    return cast.getIn().getType().isInteger(1) ? cast.getIn()
                                               : asFlag(builder, cast.getIn());
  }
};

struct NarrowFlags : OpRewritePattern<scf::IfOp> {
  using OpRewritePattern::OpRewritePattern;
  LogicalResult matchAndRewrite(scf::IfOp choice,
                                PatternRewriter &rewriter) const override {
    for (OpResult result : choice.getResults()) {
      unsigned i = result.getResultNumber();
      Type type = result.getType();
      if (!type.isInteger() || type.isInteger(1) ||
          !isFlag(choice.thenYield().getOperand(i)) ||
          !isFlag(choice.elseYield().getOperand(i)))
        continue;
      for (scf::YieldOp yield : {choice.thenYield(), choice.elseYield()}) {
        rewriter.setInsertionPoint(yield);
        Value flag = asFlag(rewriter, yield.getOperand(i));
        rewriter.modifyOpInPlace(yield, [&] { yield->setOperand(i, flag); });
      }
      rewriter.modifyOpInPlace(choice,
                               [&] { result.setType(rewriter.getI1Type()); });
      rewriter.setInsertionPointAfter(choice);
      auto number =
          arith::ExtUIOp::create(rewriter, choice.getLoc(), type, result);
      rewriter.replaceAllUsesExcept(result, number, number);
      return success();
    }
    return failure();
  }
};

/// Whether an operation may run where it would not have, and then gives a
/// number whatever its operands are.
bool isHarmless(Operation *op) {
  if (isa<arith::FPToSIOp, arith::FPToUIOp>(op))
    return false;
  if (isa<arith::ShLIOp, arith::ShRSIOp, arith::ShRUIOp>(op) &&
      !matchPattern(op->getOperand(1), m_Constant()))
    return false;
  return isPure(op) && op->getNumRegions() == 0;
}

/// Collects what must be moved out of an arm for a value to be known before;
/// false if something cannot.
bool collectSlice(Value value, Region &arm,
                  llvm::SetVector<Operation *> &slice) {
  Operation *op = value.getDefiningOp();
  if (!op || !arm.isAncestor(op->getParentRegion()))
    return !arm.isAncestor(value.getParentRegion());
  if (slice.contains(op))
    return true;
  if (op->getParentRegion() != &arm || !isHarmless(op))
    return false;
  for (Value operand : op->getOperands())
    if (!collectSlice(operand, arm, slice))
      return false;
  slice.insert(op);
  return true;
}

/// scf.if %c { .. yield %d } else { yield false }  =>  %c & %d, where %d can be
/// computed before.
struct HoistConjunction : OpRewritePattern<scf::IfOp> {
  using OpRewritePattern::OpRewritePattern;
  LogicalResult matchAndRewrite(scf::IfOp choice,
                                PatternRewriter &rewriter) const override {
    for (OpResult result : choice.getResults()) {
      unsigned i = result.getResultNumber();
      if (!result.getType().isInteger(1) || result.use_empty() ||
          !matchPattern(choice.elseYield().getOperand(i), m_Zero()))
        continue;
      Value value = choice.thenYield().getOperand(i);
      llvm::SetVector<Operation *> slice;
      if (!collectSlice(value, choice.getThenRegion(), slice))
        continue;
      for (Operation *op : slice)
        rewriter.moveOpBefore(op, choice);
      rewriter.setInsertionPoint(choice);
      Value both = arith::AndIOp::create(rewriter, choice.getLoc(),
                                         choice.getCondition(), value);
      rewriter.replaceAllUsesWith(result, both);
      return success();
    }
    return failure();
  }
};

/// Whether two values are computed alike.
bool isSame(Value a, Value b) {
  if (a == b)
    return true;
  Operation *x = a.getDefiningOp(), *y = b.getDefiningOp();
  return x && y && isPure(x) &&
         cast<OpResult>(a).getResultNumber() ==
             cast<OpResult>(b).getResultNumber() &&
         OperationEquivalence::isEquivalentTo(
             x, y, [](Value p, Value q) { return success(isSame(p, q)); },
             /*markEquivalent=*/nullptr, OperationEquivalence::IgnoreLocations);
}

/// scf.if %c { scf.if %d { .. } }  =>  scf.if %c & %d { .. }, where the second
/// arms yield the same.
struct MergeNested : OpRewritePattern<scf::IfOp> {
  using OpRewritePattern::OpRewritePattern;
  LogicalResult matchAndRewrite(scf::IfOp outer,
                                PatternRewriter &rewriter) const override {
    Operation *yield = outer.thenBlock()->getTerminator();
    auto inner = dyn_cast_or_null<scf::IfOp>(yield->getPrevNode());
    if (!inner || !isSkipped(outer) || !isSkipped(inner))
      return failure();
    for (Operation &op : *outer.thenBlock())
      if (&op != inner && &op != yield && !isPure(&op))
        return failure();
    for (unsigned i = 0, e = outer.getNumResults(); i < e; ++i) {
      auto result = dyn_cast<OpResult>(outer.thenYield().getOperand(i));
      if (!result || result.getOwner() != inner ||
          !isSame(outer.elseYield().getOperand(i),
                  inner.elseYield().getOperand(result.getResultNumber())))
        return failure();
    }
    llvm::SetVector<Operation *> test;
    if (!collectSlice(inner.getCondition(), outer.getThenRegion(), test))
      return failure();
    for (Operation *op : test)
      rewriter.moveOpBefore(op, outer);
    SmallVector<Value> values;
    for (Value value : outer.thenYield().getOperands())
      values.push_back(inner.thenYield().getOperand(
          cast<OpResult>(value).getResultNumber()));
    rewriter.setInsertionPoint(outer);
    Value both = arith::AndIOp::create(
        rewriter, inner.getLoc(), outer.getCondition(), inner.getCondition());
    auto first = getProbability(outer, outer.getThenRegion());
    auto second = getProbability(inner, inner.getThenRegion());
    rewriter.modifyOpInPlace(outer, [&] {
      outer.getConditionMutable().assign(both);
      setProbability(outer, first && second ? std::optional(*first * *second)
                                            : std::nullopt);
    });
    rewriter.modifyOpInPlace(outer.thenYield(),
                             [&] { outer.thenYield()->setOperands(values); });
    rewriter.eraseOp(inner.thenYield());
    rewriter.inlineBlockBefore(inner.thenBlock(), inner);
    rewriter.eraseOp(inner);
    return success();
  }

  /// Whether the second arm does nothing, if there is one.
  static bool isSkipped(scf::IfOp choice) {
    return choice.getElseRegion().empty() || isEmpty(choice.getElseRegion());
  }
};

/// scf.while { .. scf.if %c { work } scf.condition(%c) } do { rest }
/// =>  scf.while { .. scf.condition(%c) } do { work rest }
struct MoveWorkAfter : OpRewritePattern<scf::WhileOp> {
  using OpRewritePattern::OpRewritePattern;
  LogicalResult matchAndRewrite(scf::WhileOp loop,
                                PatternRewriter &rewriter) const override {
    scf::ConditionOp condition = loop.getConditionOp();
    auto choice = dyn_cast_or_null<scf::IfOp>(condition->getPrevNode());
    if (!choice || choice.getCondition() == condition.getCondition() ||
        !isSame(choice.getCondition(), condition.getCondition()))
      return failure();
    // Upstream's pattern does the rest.
    rewriter.modifyOpInPlace(choice, [&] {
      choice.getConditionMutable().assign(condition.getCondition());
    });
    return success();
  }
};

} // namespace

void NormalizeLoopsPass::runOnOperation() {
  RewritePatternSet patterns(&getContext());
  patterns.add<JoinConditions, InvertComparisons, ExchangeArms, TestFlags,
               NarrowFlags, HoistConjunction, MergeNested, MoveWorkAfter>(
      &getContext());
  scf::IfOp::getCanonicalizationPatterns(patterns, &getContext());
  scf::WhileOp::getCanonicalizationPatterns(patterns, &getContext());
  arith::ExtUIOp::getCanonicalizationPatterns(patterns, &getContext());
  arith::TruncIOp::getCanonicalizationPatterns(patterns, &getContext());
  // What is left undone is no worse than before.
  (void)applyPatternsGreedily(
      getOperation(), std::move(patterns),
      GreedyRewriteConfig().setListener(getProbabilityKeeper()));
}
