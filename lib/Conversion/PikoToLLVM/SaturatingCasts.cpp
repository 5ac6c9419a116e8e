// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Casts from float to integer that saturate, where the number nearly always
// fits: one comparison and a branch, instead of three comparisons and choices.

#include "PikoToLLVM/LoweringContext.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

/// The choice of `constant` where `value` compares so with something, or else
/// of what is returned; null if `choice` is none.
static Value matchChoice(Value choice, Value value,
                         arith::CmpFPredicate predicate,
                         llvm::function_ref<bool(const APInt &)> isConstant) {
  auto select = choice.getDefiningOp<arith::SelectOp>();
  auto compare = select ? select.getCondition().getDefiningOp<arith::CmpFOp>()
                        : arith::CmpFOp();
  APInt constant;
  if (!compare || compare.getPredicate() != predicate ||
      compare.getLhs() != value ||
      !matchPattern(select.getTrueValue(), m_ConstantInt(&constant)) ||
      !isConstant(constant))
    return Value();
  return select.getFalseValue();
}

/// The cast whose saturated result this is: NaN is 0, what is too low the
/// lowest integer, what is too high the highest.
static arith::FPToSIOp matchSaturated(arith::SelectOp result) {
  auto isNaN = result.getCondition().getDefiningOp<arith::CmpFOp>();
  if (!isNaN || isNaN.getPredicate() != arith::CmpFPredicate::UNO ||
      isNaN.getLhs() != isNaN.getRhs())
    return nullptr;
  Value value = isNaN.getLhs();
  Value rest = matchChoice(result, value, arith::CmpFPredicate::UNO,
                           [](const APInt &c) { return c.isZero(); });
  if (rest)
    rest = matchChoice(rest, value, arith::CmpFPredicate::OLT,
                       [](const APInt &c) { return c.isMinSignedValue(); });
  if (rest)
    rest = matchChoice(rest, value, arith::CmpFPredicate::OGE,
                       [](const APInt &c) { return c.isMaxSignedValue(); });
  auto cast = rest ? rest.getDefiningOp<arith::FPToSIOp>() : arith::FPToSIOp();
  return cast && cast.getIn() == value ? cast : arith::FPToSIOp();
}

/// What a number that does not fit becomes.
static Value createSaturated(OpBuilder &builder, Location loc, Value value,
                             Type type) {
  unsigned bits = type.getIntOrFloatBitWidth();
  auto makeInteger = [&](const APInt &number) {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getIntegerAttr(type, number));
  };
  Value zero = arith::ConstantOp::create(builder, loc,
                                         builder.getZeroAttr(value.getType()));
  Value isHigh = arith::CmpFOp::create(builder, loc, arith::CmpFPredicate::OGT,
                                       value, zero);
  Value isNaN = arith::CmpFOp::create(builder, loc, arith::CmpFPredicate::UNO,
                                      value, value);
  Value end = arith::SelectOp::create(
      builder, loc, isHigh, makeInteger(APInt::getSignedMaxValue(bits)),
      makeInteger(APInt::getSignedMinValue(bits)));
  return arith::SelectOp::create(builder, loc, isNaN,
                                 makeInteger(APInt::getZero(bits)), end);
}

static Value createBranch(OpBuilder &builder, Location loc, Value value,
                          Type type) {
  auto floatType = cast<FloatType>(value.getType());
  APFloat above = llvm::scalbn(APFloat(floatType.getFloatSemantics(), 1),
                               type.getIntOrFloatBitWidth() - 1,
                               APFloat::rmNearestTiesToEven);
  Value bound = arith::ConstantOp::create(
      builder, loc, builder.getFloatAttr(floatType, above));
  Value size = math::AbsFOp::create(builder, loc, value);
  Value fits = arith::CmpFOp::create(builder, loc, arith::CmpFPredicate::OLT,
                                     size, bound);
  Value always =
      arith::ConstantOp::create(builder, loc, builder.getBoolAttr(true));
  fits = LLVM::ExpectOp::create(builder, loc, fits, always);
  auto choice = scf::IfOp::create(
      builder, loc, fits,
      [&](OpBuilder &builder, Location loc) {
        Value integer = arith::FPToSIOp::create(builder, loc, type, value);
        scf::YieldOp::create(builder, loc, integer);
      },
      [&](OpBuilder &builder, Location loc) {
        scf::YieldOp::create(builder, loc,
                             createSaturated(builder, loc, value, type));
      });
  return choice.getResult(0);
}

void piko::branchInSaturatingCasts(func::FuncOp function) {
  SmallVector<std::pair<arith::SelectOp, Value>> casts;
  function.walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (isa<gpu::LaunchOp>(op)) // where threads would part
      return WalkResult::skip();
    auto result = dyn_cast<arith::SelectOp>(op);
    if (result && isa<IntegerType>(result.getType()))
      if (arith::FPToSIOp cast = matchSaturated(result))
        casts.push_back({result, cast.getIn()});
    return WalkResult::advance();
  });
  for (auto [result, value] : casts) {
    OpBuilder builder(result);
    result.replaceAllUsesWith(
        createBranch(builder, result.getLoc(), value, result.getType()));
    result.erase();
  }
}
