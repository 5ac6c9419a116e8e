// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-apply-precision: for each process phase, choose functions that are as
// far from the exact result as it allows. If it need not be strict,
//   1. of divisions and square roots in f32, make approximations. The
//      reciprocal of a constant is the nearest number, unless that has fewer
//      bits;
//   2. make additions of products math.fma, whether or not a product is used
//      elsewhere, and also if both sides of a condition yield one. Of two
//      products the left one is fused.

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoApproximation.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/ImplicitLocOpBuilder.h"
#include "mlir/IR/Matchers.h"
#include "mlir/IR/TypeUtilities.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Transforms/GreedyPatternRewriteDriver.h"

namespace piko {
#define GEN_PASS_DEF_APPLYPRECISION
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct ApplyPrecisionPass : piko::impl::ApplyPrecisionBase<ApplyPrecisionPass> {
  void runOnOperation() override;
};

} // namespace

//===----------------------------------------------------------------------===//
// Approximations
//===----------------------------------------------------------------------===//

static bool isOne(Value value) { return matchPattern(value, m_OneFloat()); }

/// The operand of a square root, or null.
static Value getRooted(Value value) {
  auto root = value.getDefiningOp<math::SqrtOp>();
  return root ? root.getOperand() : Value();
}

static Value replaceDivision(ImplicitLocOpBuilder &builder, Value dividend,
                             Value divisor) {
  Value inverse;
  FloatAttr constant;
  if (matchPattern(divisor, m_Constant(&constant))) {
    // The nearest number, unless that has fewer bits.
    APFloat value = constant.getValue(), one(1.0f);
    one.divide(value, APFloat::rmNearestTiesToEven);
    if (!one.isNormal() || !value.isNormal())
      return {};
    inverse = arith::ConstantOp::create(
        builder, builder.getF32FloatAttr(one.convertToFloat()));
  } else if (Value x = getRooted(divisor)) {
    inverse = ApproximateRsqrtOp::create(builder, x);
  } else {
    inverse = ApproximateReciprocalOp::create(builder, divisor);
  }
  if (isOne(dividend))
    return inverse;
  return arith::MulFOp::create(builder, dividend, inverse);
}

/// What replaces a division or a square root in f32, or null.
static Value approximate(Operation *op) {
  ImplicitLocOpBuilder builder(op->getLoc(), op);
  if (op->getNumResults() != 1 || !op->getResult(0).getType().isF32())
    return {};
  if (auto division = dyn_cast<arith::DivFOp>(op))
    return replaceDivision(builder, division.getLhs(), division.getRhs());
  if (auto root = dyn_cast<math::SqrtOp>(op))
    return ApproximateSqrtOp::create(builder, root.getOperand());
  return {};
}

//===----------------------------------------------------------------------===//
// Contraction
//===----------------------------------------------------------------------===//

/// A product, and whether it is negated.
struct Product {
  arith::MulFOp op;
  bool isNegative = false;
};

static Product getProduct(Value value) {
  if (auto negation = value.getDefiningOp<arith::NegFOp>())
    return {negation.getOperand().getDefiningOp<arith::MulFOp>(), true};
  return {value.getDefiningOp<arith::MulFOp>()};
}

/// What a sum becomes: a * b + c, with the signs that `isDifference` and the
/// product ask for; null where neither side is a product.
static Value contract(Operation *sum, bool isDifference) {
  Value left = sum->getOperand(0), right = sum->getOperand(1);
  ImplicitLocOpBuilder builder(sum->getLoc(), sum);
  auto negateIf = [&](bool isNegative, Value value) -> Value {
    return isNegative ? arith::NegFOp::create(builder, value).getResult()
                      : value;
  };
  Product product = getProduct(left);
  bool isLeft = bool(product.op);
  if (!isLeft)
    product = getProduct(right);
  if (!product.op)
    return {};
  bool negates = product.isNegative != (isDifference && !isLeft);
  Value addend = isLeft ? negateIf(isDifference, right) : left;
  return math::FmaOp::create(builder, negateIf(negates, product.op.getLhs()),
                             product.op.getRhs(), addend);
}

/// A product that both sides of a condition yield, of numbers that they yield
/// then; null if one yields something else, or nothing adds to it.
static Value splitProduct(OpResult result, scf::IfOp choice) {
  unsigned number = result.getResultNumber();
  auto getYielded = [&](Region &side) {
    Value value = side.front().getTerminator()->getOperand(number);
    return value.getDefiningOp<arith::MulFOp>();
  };
  arith::MulFOp yes = getYielded(choice.getThenRegion()),
                no = getYielded(choice.getElseRegion());
  if (!yes || !no || llvm::none_of(result.getUsers(), [](Operation *user) {
        return isa<arith::AddFOp, arith::SubFOp>(user);
      }))
    return {};
  // The sides stay where they are, in a condition with two more results.
  OpBuilder builder(choice);
  SmallVector<Type> types(choice.getResultTypes());
  types.append(2, result.getType());
  auto made =
      scf::IfOp::create(builder, choice.getLoc(), types, choice.getCondition());
  made.getThenRegion().takeBody(choice.getThenRegion());
  made.getElseRegion().takeBody(choice.getElseRegion());
  made.thenYield()->insertOperands(types.size() - 2,
                                   {yes.getLhs(), yes.getRhs()});
  made.elseYield()->insertOperands(types.size() - 2,
                                   {no.getLhs(), no.getRhs()});
  builder.setInsertionPointAfter(made);
  auto factors = made.getResults().take_back(2);
  Value product =
      arith::MulFOp::create(builder, yes.getLoc(), factors[0], factors[1]);
  choice.replaceAllUsesWith(made.getResults().drop_back(2));
  made.getResult(number).replaceAllUsesWith(product);
  choice.erase();
  return product;
}

/// Products that leave a condition as such can be contracted with what is added
/// after it.
static void splitProducts(ProcessOp process) {
  SmallVector<scf::IfOp> choices;
  process.getBody().walk([&](scf::IfOp choice) {
    if (choice.getNumResults() > 0)
      choices.push_back(choice);
  });
  for (scf::IfOp choice : choices)
    for (unsigned i = 0, count = choice.getNumResults(); i < count; ++i)
      if (Value product = splitProduct(choice->getResult(i), choice))
        choice =
            product.getDefiningOp()->getOperand(0).getDefiningOp<scf::IfOp>();
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

/// All operations in a phase, users first.
static SmallVector<Operation *> collectBackwards(ProcessOp process) {
  SmallVector<Operation *> ops;
  process.getBody().walk([&](Operation *op) { ops.push_back(op); });
  std::reverse(ops.begin(), ops.end());
  return ops;
}

static void removeUnused(ProcessOp process) {
  for (Operation *op : collectBackwards(process))
    if (isa<arith::ArithDialect, math::MathDialect>(op->getDialect()) &&
        isOpTriviallyDead(op))
      op->erase();
}

namespace {
struct Counts {
  int64_t contracted = 0, reciprocals = 0, roots = 0;
};
} // namespace

/// 1 / sqrt(x) is seen before sqrt(x) is gone.
static void approximate(ProcessOp process, Counts &counts) {
  for (Operation *op : collectBackwards(process)) {
    Value value = op->use_empty() ? Value() : approximate(op);
    if (!value)
      continue;
    ++(isa<arith::DivFOp>(op) ? counts.reciprocals : counts.roots);
    op->getResult(0).replaceAllUsesWith(value);
  }
}

static void contract(ProcessOp process, Counts &counts) {
  for (Operation *op : collectBackwards(process)) {
    if (!isa<arith::AddFOp, arith::SubFOp>(op) || op->use_empty())
      continue;
    Type type = getElementTypeOrSelf(op->getResult(0).getType());
    if (!type.isF32() && !type.isF64())
      continue;
    if (Value value = contract(op, isa<arith::SubFOp>(op))) {
      ++counts.contracted;
      op->getResult(0).replaceAllUsesWith(value);
    }
  }
}

/// Answers what asks how far functions may be from the exact result, and takes
/// the branches that follow.
static void chooseFunctions(Operation *phase, int64_t ulps) {
  bool asks = false;
  phase->walk([&](AllowsUlpsOp op) {
    asks = true;
    OpBuilder builder(op);
    op.replaceAllUsesWith(
        arith::ConstantIntOp::create(builder, op.getLoc(),
                                     int64_t(op.getUlps()) <= ulps, /*width=*/1)
            .getResult());
    op.erase();
  });
  if (!asks)
    return;
  RewritePatternSet patterns(phase->getContext());
  scf::IfOp::getCanonicalizationPatterns(patterns, phase->getContext());
  arith::SelectOp::getCanonicalizationPatterns(patterns, phase->getContext());
  (void)applyPatternsGreedily(phase, std::move(patterns));
}

static int64_t getAllowedUlps(ProcessOp process) {
  // Of a float; what Precision::Relaxed does to divisions is about as much.
  constexpr int64_t relaxed = 4;
  if (std::optional<uint64_t> ulps = process.getUlps())
    return int64_t(*ulps);
  return process.getPrecision() == Precision::Relaxed ? relaxed : 0;
}

void ApplyPrecisionPass::runOnOperation() {
  for (auto stage : getOperation().getOps<StageOp>())
    for (Operation &phase : *stage.getBodyBlock()) {
      auto process = dyn_cast<ProcessOp>(phase);
      chooseFunctions(&phase, process ? getAllowedUlps(process) : 0);
      if (process)
        process.removeUlpsAttr();
    }
  for (auto stage : getOperation().getOps<StageOp>()) {
    ProcessOp process = stage.getProcess();
    if (!process || !process.getPrecision())
      continue;
    Precision precision = *process.getPrecision();
    process.removePrecisionAttr();
    if (precision == Precision::Strict)
      continue;
    Counts counts;
    if (precision == Precision::Relaxed) {
      approximate(process, counts);
      removeUnused(process);
    }
    splitProducts(process);
    contract(process, counts);
    removeUnused(process);
    process.emitRemark() << "stage '" << getCppName(stage) << "' is "
                         << stringifyPrecision(precision) << ": "
                         << counts.contracted << " additions are contracted, "
                         << counts.reciprocals << " divisions and "
                         << counts.roots << " square roots approximated";
  }
}
