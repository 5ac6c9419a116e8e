// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-expand-remainders: the remainder of floats, which PTX has no instruction
// for, by long division of the significands, as many bits at a time as an
// integer has room for. Each step is exact, as is what C's fmod gives.

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {
#define GEN_PASS_DEF_EXPANDREMAINDERS
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// Expands one remainder.
class RemainderExpansion {
public:
  explicit RemainderExpansion(arith::RemFOp op)
      : builder(op), loc(op.getLoc()), x(op.getLhs()), y(op.getRhs()),
        type(cast<FloatType>(op.getType())),
        bits(builder.getIntegerType(type.getWidth())),
        mantissa(type.getFPMantissaWidth() - 1) {}

  Value expand();

private:
  using P = arith::CmpIPredicate;

  Value constant(Type of, const APInt &value) {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getIntegerAttr(of, value));
  }
  Value constant(uint64_t value) {
    return constant(bits, APInt(type.getWidth(), value));
  }
  Value wide(uint64_t value) {
    return constant(builder.getI64Type(), APInt(64, value));
  }
  Value compare(P predicate, Value a, Value b) {
    return arith::CmpIOp::create(builder, loc, predicate, a, b);
  }
  Value select(Value condition, Value a, Value b) {
    return arith::SelectOp::create(builder, loc, condition, a, b);
  }
  template <typename OpT> Value create(Value a, Value b) {
    return OpT::create(builder, loc, a, b);
  }
  Value toFloat(Value pattern) {
    return arith::BitcastOp::create(builder, loc, type, pattern);
  }
  Value toWide(Value number) {
    return number.getType().isInteger(64)
               ? number
               : arith::ExtUIOp::create(builder, loc, builder.getI64Type(),
                                        number)
                     .getResult();
  }
  /// A number without its sign, as its bits.
  Value getMagnitude(Value number) {
    Value pattern = arith::BitcastOp::create(builder, loc, bits, number);
    return create<arith::AndIOp>(
        pattern, constant(bits, APInt::getSignedMaxValue(type.getWidth())));
  }
  /// Its exponent, from 1 on, and its significand, so that it is
  /// significand * 2^(exponent - 1) units in the last place of the smallest.
  std::pair<Value, Value> split(Value magnitude);
  Value reduce(Value dividend, Value divisor, Value places);
  Value scale(Value significand, Value exponent);
  Value divide(Value a, Value b);

  OpBuilder builder;
  Location loc;
  Value x, y;
  FloatType type;
  IntegerType bits;
  unsigned mantissa; ///< Bits of a significand that are stored.
};

} // namespace

std::pair<Value, Value> RemainderExpansion::split(Value magnitude) {
  Value one = constant(1);
  Value exponent = create<arith::ShRUIOp>(magnitude, constant(mantissa));
  uint64_t hidden = uint64_t(1) << mantissa;
  Value stored = create<arith::AndIOp>(magnitude, constant(hidden - 1));
  Value isSubnormal = compare(P::eq, exponent, constant(0));
  return {select(isSubnormal, one, exponent),
          select(isSubnormal, stored,
                 create<arith::OrIOp>(stored, constant(hidden)))};
}

/// The remainder of dividend * 2^places.
Value RemainderExpansion::reduce(Value dividend, Value divisor, Value places) {
  // A remainder has as many bits as a divisor, one more than are stored.
  Value room = wide(64 - (mantissa + 1));
  Value first = create<arith::RemUIOp>(dividend, divisor);
  SmallVector<Type> types(2, builder.getI64Type());
  auto loop = scf::WhileOp::create(
      builder, loc, types, ValueRange{first, places},
      [&](OpBuilder &inner, Location loc, ValueRange state) {
        OpBuilder::InsertionGuard guard(builder);
        builder.setInsertionPointToEnd(inner.getInsertionBlock());
        Value more = compare(P::ne, state[1], wide(0));
        scf::ConditionOp::create(builder, loc, more, state);
      },
      [&](OpBuilder &inner, Location loc, ValueRange state) {
        OpBuilder::InsertionGuard guard(builder);
        builder.setInsertionPointToEnd(inner.getInsertionBlock());
        Value now = create<arith::MinUIOp>(state[1], room);
        Value shifted = create<arith::ShLIOp>(state[0], now);
        Value rest = create<arith::RemUIOp>(shifted, divisor);
        Value left = create<arith::SubIOp>(state[1], now);
        scf::YieldOp::create(builder, loc, ValueRange{rest, left});
      });
  return loop.getResult(0);
}

/// significand * 2^(exponent - 1) units, as a number.
Value RemainderExpansion::scale(Value significand, Value exponent) {
  Value number = arith::UIToFPOp::create(builder, loc, type, significand);
  // 2^(exponent - 1) units: a subnormal number, or one with that exponent.
  Value isNormal = compare(P::ugt, exponent, constant(mantissa));
  Value normal = create<arith::ShLIOp>(
      create<arith::SubIOp>(exponent, constant(mantissa)), constant(mantissa));
  Value place = select(isNormal, constant(0),
                       create<arith::SubIOp>(exponent, constant(1)));
  Value subnormal = create<arith::ShLIOp>(constant(1), place);
  return create<arith::MulFOp>(number,
                               toFloat(select(isNormal, normal, subnormal)));
}

/// Of two magnitudes, the first at least the second, which is not 0.
Value RemainderExpansion::divide(Value a, Value b) {
  auto [exponentA, significandA] = split(a);
  auto [exponentB, significandB] = split(b);
  Value places = create<arith::SubIOp>(exponentA, exponentB);
  Value rest =
      reduce(toWide(significandA), toWide(significandB), toWide(places));
  return scale(rest, exponentB);
}

Value RemainderExpansion::expand() {
  Value a = getMagnitude(x), b = getMagnitude(y);
  APInt infinity = APFloat::getInf(type.getFloatSemantics()).bitcastToAPInt();
  Value inf = constant(bits, infinity);
  Value isSmaller = compare(P::ult, a, b);
  Value isNone =
      create<arith::OrIOp>(create<arith::OrIOp>(compare(P::eq, b, constant(0)),
                                                compare(P::uge, a, inf)),
                           compare(P::ugt, b, inf));
  Value isKnown = create<arith::OrIOp>(isSmaller, isNone);
  auto choice =
      scf::IfOp::create(builder, loc, type, isKnown, /*withElseRegion=*/true);
  builder.setInsertionPointToStart(choice.thenBlock());
  Value nan = arith::ConstantOp::create(
      builder, loc,
      builder.getFloatAttr(type, APFloat::getNaN(type.getFloatSemantics())));
  scf::YieldOp::create(builder, loc, select(isNone, nan, x));
  builder.setInsertionPointToStart(choice.elseBlock());
  Value magnitude = divide(a, b);
  Value rest = math::CopySignOp::create(builder, loc, magnitude, x);
  scf::YieldOp::create(builder, loc, rest);
  return choice.getResult(0);
}

namespace {

struct ExpandRemaindersPass
    : piko::impl::ExpandRemaindersBase<ExpandRemaindersPass> {
  void runOnOperation() override;
};

} // namespace

void ExpandRemaindersPass::runOnOperation() {
  SmallVector<arith::RemFOp> remainders;
  getOperation().walk([&](arith::RemFOp op) {
    // Others are refused by piko-form-grids.
    if (op->getParentOfType<KernelOp>() &&
        (op.getType().isF32() || op.getType().isF64()))
      remainders.push_back(op);
  });
  for (arith::RemFOp op : remainders) {
    op.replaceAllUsesWith(RemainderExpansion(op).expand());
    op.erase();
  }
}
