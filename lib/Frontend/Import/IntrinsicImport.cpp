//===- IntrinsicImport.cpp - Intrinsics on numbers to arith and math ------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM makes intrinsics of what a text writes out, as of shifts and masks that
// swap bytes.

#include "Import/ScalarImport.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "llvm/IR/Constants.h"
#include "llvm/IR/Instructions.h"

using namespace piko;
using llvm::cast;
using llvm::dyn_cast;
using mlir::Type;
using mlir::Value;
namespace arith = mlir::arith;
namespace math = mlir::math;

/// Whether a sum, a difference or a product leaves its type.
Value ScalarImporter::makeOverflow(llvm::Intrinsic::ID id, Value a, Value b) {
  using P = arith::CmpIPredicate;
  Type type = a.getType();
  unsigned bits = type.getIntOrFloatBitWidth();
  Value zero = makeInteger(type, llvm::APInt(bits, 0));
  switch (id) {
  case llvm::Intrinsic::uadd_with_overflow:
    return make<arith::CmpIOp>(P::ult, make<arith::AddIOp>(a, b), a);
  case llvm::Intrinsic::usub_with_overflow:
    return make<arith::CmpIOp>(P::ult, a, b);
  case llvm::Intrinsic::umul_with_overflow: {
    auto product = arith::MulUIExtendedOp::create(builder, *location, a, b);
    return make<arith::CmpIOp>(P::ne, product.getHigh(), zero);
  }
  case llvm::Intrinsic::sadd_with_overflow: {
    // Its sign is neither that of the one nor that of the other.
    Value sum = make<arith::AddIOp>(a, b);
    Value both = make<arith::AndIOp>(make<arith::XOrIOp>(sum, a),
                                     make<arith::XOrIOp>(sum, b));
    return make<arith::CmpIOp>(P::slt, both, zero);
  }
  case llvm::Intrinsic::ssub_with_overflow: {
    Value both =
        make<arith::AndIOp>(make<arith::XOrIOp>(a, b),
                            make<arith::XOrIOp>(make<arith::SubIOp>(a, b), a));
    return make<arith::CmpIOp>(P::slt, both, zero);
  }
  case llvm::Intrinsic::smul_with_overflow: {
    auto product = arith::MulSIExtendedOp::create(builder, *location, a, b);
    Value sign = make<arith::ShRSIOp>(
        product.getLow(), makeInteger(type, llvm::APInt(bits, bits - 1)));
    return make<arith::CmpIOp>(P::ne, product.getHigh(), sign);
  }
  default:
    return Value();
  }
}

/// A part of what an operation with overflow gives.
Value ScalarImporter::importOverflow(llvm::Instruction *instruction) {
  auto *extract = cast<llvm::ExtractValueInst>(instruction);
  auto *call = dyn_cast<llvm::WithOverflowInst>(extract->getAggregateOperand());
  if (!call)
    return Value();
  Value a = get(call->getLHS()), b = get(call->getRHS());
  if (extract->getIndices()[0] == 1)
    return makeOverflow(call->getIntrinsicID(), a, b);
  switch (call->getBinaryOp()) {
  case llvm::Instruction::Add:
    return make<arith::AddIOp>(a, b);
  case llvm::Instruction::Sub:
    return make<arith::SubIOp>(a, b);
  default:
    return make<arith::MulIOp>(a, b);
  }
}

Value ScalarImporter::makeFunnelShift(llvm::IntrinsicInst *call, bool left) {
  Value a = get(call->getArgOperand(0)), b = get(call->getArgOperand(1));
  Type type = a.getType();
  unsigned bits = type.getIntOrFloatBitWidth();
  Value last = makeInteger(type, llvm::APInt(bits, bits - 1));
  Value one = makeInteger(type, llvm::APInt(bits, 1));
  Value amount = make<arith::AndIOp>(get(call->getArgOperand(2)), last);
  // A shift by the width is undefined, so that the other part goes in two
  // steps.
  Value rest = make<arith::SubIOp>(last, amount);
  if (left)
    return make<arith::OrIOp>(
        make<arith::ShLIOp>(a, amount),
        make<arith::ShRUIOp>(make<arith::ShRUIOp>(b, one), rest));
  return make<arith::OrIOp>(
      make<arith::ShRUIOp>(b, amount),
      make<arith::ShLIOp>(make<arith::ShLIOp>(a, one), rest));
}

/// Tests that are one or two comparisons of the absolute value; the others go
/// by bits.
Value ScalarImporter::makeClassTest(llvm::IntrinsicInst *call) {
  Value value = get(call->getArgOperand(0));
  auto classes = static_cast<llvm::FPClassTest>(
      cast<llvm::ConstantInt>(call->getArgOperand(1))->getZExtValue());
  auto type = cast<mlir::FloatType>(value.getType());
  const llvm::fltSemantics &semantics = type.getFloatSemantics();
  auto compare = [&](arith::CmpFPredicate predicate, llvm::APFloat bound) {
    return make<arith::CmpFOp>(
        predicate, make<math::AbsFOp>(value),
        make<arith::ConstantOp>(builder.getFloatAttr(type, bound)));
  };
  llvm::APFloat infinity = llvm::APFloat::getInf(semantics);
  llvm::APFloat zero = llvm::APFloat::getZero(semantics);
  llvm::APFloat normal = llvm::APFloat::getSmallestNormalized(semantics);
  using P = arith::CmpFPredicate;
  switch (static_cast<unsigned>(classes)) {
  case llvm::fcNan:
    return compare(P::UNO, zero);
  case llvm::fcAllFlags & ~llvm::fcNan:
    return compare(P::ORD, zero);
  case llvm::fcInf:
    return compare(P::OEQ, infinity);
  case llvm::fcAllFlags & ~llvm::fcInf:
    return compare(P::UNE, infinity);
  case llvm::fcFinite:
    return compare(P::ONE, infinity);
  case llvm::fcAllFlags & ~llvm::fcFinite:
    return compare(P::UEQ, infinity);
  case llvm::fcZero:
    return compare(P::OEQ, zero);
  case llvm::fcAllFlags & ~llvm::fcZero:
    return compare(P::UNE, zero);
  case llvm::fcNormal:
    return make<arith::AndIOp>(compare(P::OGE, normal),
                               compare(P::ONE, infinity));
  case llvm::fcSubnormal:
    return make<arith::AndIOp>(compare(P::OLT, normal), compare(P::ONE, zero));
  default:
    return makeClassTestByBits(value, classes);
  }
}

/// As integers, the numbers of each sign are in order of size, so that
/// neighbouring classes are a range.
Value ScalarImporter::makeClassTestByBits(Value value,
                                          llvm::FPClassTest classes) {
  using llvm::APFloat;
  auto type = cast<mlir::FloatType>(value.getType());
  const llvm::fltSemantics &semantics = type.getFloatSemantics();
  unsigned bits = type.getWidth();
  auto integer = builder.getIntegerType(bits);
  Value number = make<arith::BitcastOp>(integer, value);
  Value result = makeInteger(builder.getI1Type(), llvm::APInt(1, 0));
  for (bool negative : {false, true}) {
    llvm::APInt sign =
        negative ? llvm::APInt::getSignMask(bits) : llvm::APInt(bits, 0);
    auto bitsOf = [](const APFloat &bound) { return bound.bitcastToAPInt(); };
    llvm::APInt infinity = bitsOf(APFloat::getInf(semantics));
    const std::pair<llvm::FPClassTest, llvm::APInt> begins[] = {
        {negative ? llvm::fcNegZero : llvm::fcPosZero, llvm::APInt(bits, 0)},
        {negative ? llvm::fcNegSubnormal : llvm::fcPosSubnormal,
         llvm::APInt(bits, 1)},
        {negative ? llvm::fcNegNormal : llvm::fcPosNormal,
         bitsOf(APFloat::getSmallestNormalized(semantics))},
        {negative ? llvm::fcNegInf : llvm::fcPosInf, infinity},
        {llvm::fcSNan, infinity + 1},
        {llvm::fcQNan, bitsOf(APFloat::getQNaN(semantics))},
        {llvm::fcNone, llvm::APInt::getSignMask(bits)}};
    for (unsigned i = 0; i + 1 < std::size(begins);) {
      unsigned end = i;
      while (begins[end].first & classes)
        ++end;
      if (end != i) {
        Value offset = make<arith::SubIOp>(
            number, makeInteger(integer, begins[i].second | sign));
        Value inside = make<arith::CmpIOp>(
            arith::CmpIPredicate::ult, offset,
            makeInteger(integer, begins[end].second - begins[i].second));
        result = make<arith::OrIOp>(result, inside);
      }
      i = std::max(end, i + 1);
    }
  }
  return result;
}

/// A sum or a difference of signed numbers, or the bound beyond which it is.
Value ScalarImporter::makeSaturating(llvm::IntrinsicInst *call) {
  Value a = get(call->getArgOperand(0)), b = get(call->getArgOperand(1));
  Type type = a.getType();
  unsigned bits = type.getIntOrFloatBitWidth();
  bool isSum = call->getIntrinsicID() == llvm::Intrinsic::sadd_sat;
  Value result = isSum ? Value(make<arith::AddIOp>(a, b))
                       : Value(make<arith::SubIOp>(a, b));
  // It goes beyond the bound on the side where the first number is.
  Value sign =
      make<arith::ShRSIOp>(a, makeInteger(type, llvm::APInt(bits, bits - 1)));
  Value bound = make<arith::XOrIOp>(
      sign, makeInteger(type, llvm::APInt::getSignedMaxValue(bits)));
  return make<arith::SelectOp>(
      makeOverflow(isSum ? llvm::Intrinsic::sadd_with_overflow
                         : llvm::Intrinsic::ssub_with_overflow,
                   a, b),
      bound, result);
}

/// Swaps neighbours of `from` bits, pairs of these, and so on: all bits from 1
/// on, all bytes from 8 on. Null if the halves are not alike in the end.
Value ScalarImporter::makeReversal(Value value, unsigned from) {
  Type type = value.getType();
  unsigned bits = type.getIntOrFloatBitWidth();
  if (!llvm::isPowerOf2_32(bits))
    return Value();
  for (unsigned size = from; size < bits; size *= 2) {
    Value amount = makeInteger(type, llvm::APInt(bits, size));
    Value low = makeInteger(
        type, llvm::APInt::getSplat(
                  bits, llvm::APInt::getLowBitsSet(2 * size, size)));
    value = make<arith::OrIOp>(
        make<arith::ShLIOp>(make<arith::AndIOp>(value, low), amount),
        make<arith::AndIOp>(make<arith::ShRUIOp>(value, amount), low));
  }
  return value;
}

/// -1, 0 or 1.
Value ScalarImporter::makeThreeWay(llvm::IntrinsicInst *call, bool isSigned) {
  using P = arith::CmpIPredicate;
  Value a = get(call->getArgOperand(0)), b = get(call->getArgOperand(1));
  Type type = getType(call->getType());
  unsigned bits = type.getIntOrFloatBitWidth();
  Value less = make<arith::CmpIOp>(isSigned ? P::slt : P::ult, a, b);
  Value greater = make<arith::CmpIOp>(isSigned ? P::sgt : P::ugt, a, b);
  Value result =
      make<arith::SelectOp>(greater, makeInteger(type, llvm::APInt(bits, 1)),
                            makeInteger(type, llvm::APInt(bits, 0)));
  return make<arith::SelectOp>(
      less, makeInteger(type, llvm::APInt::getAllOnes(bits)), result);
}

Value ScalarImporter::importIntrinsic(llvm::IntrinsicInst *call) {
  auto operand = [&](unsigned i) { return get(call->getArgOperand(i)); };
  Type type = getType(call->getType());
  switch (call->getIntrinsicID()) {
#define UNARY(FROM, TO)                                                        \
  case llvm::Intrinsic::FROM:                                                  \
    return make<TO>(operand(0));
#define BINARY(FROM, TO)                                                       \
  case llvm::Intrinsic::FROM:                                                  \
    return make<TO>(operand(0), operand(1));
    UNARY(fabs, math::AbsFOp)
    UNARY(floor, math::FloorOp)
    UNARY(ceil, math::CeilOp)
    UNARY(trunc, math::TruncOp)
    UNARY(round, math::RoundOp)
    UNARY(rint, math::RoundEvenOp)
    UNARY(nearbyint, math::RoundEvenOp)
    UNARY(roundeven, math::RoundEvenOp)
    UNARY(sqrt, math::SqrtOp)
    UNARY(abs, math::AbsIOp)
    UNARY(ctlz, math::CountLeadingZerosOp)
    UNARY(cttz, math::CountTrailingZerosOp)
    UNARY(ctpop, math::CtPopOp)
    BINARY(copysign, math::CopySignOp)
    BINARY(smin, arith::MinSIOp)
    BINARY(smax, arith::MaxSIOp)
    BINARY(umin, arith::MinUIOp)
    BINARY(umax, arith::MaxUIOp)
#undef UNARY
#undef BINARY
  case llvm::Intrinsic::fma:
    return make<math::FmaOp>(operand(0), operand(1), operand(2));
  case llvm::Intrinsic::fmuladd:
    return make<arith::AddFOp>(make<arith::MulFOp>(operand(0), operand(1)),
                               operand(2));
  case llvm::Intrinsic::fptosi_sat:
    return convertToInteger(operand(0), type, /*isSigned=*/true);
  case llvm::Intrinsic::fptoui_sat:
    return convertToInteger(operand(0), type, /*isSigned=*/false);
  case llvm::Intrinsic::fshl:
    return makeFunnelShift(call, /*left=*/true);
  case llvm::Intrinsic::fshr:
    return makeFunnelShift(call, /*left=*/false);
  case llvm::Intrinsic::usub_sat:
    return make<arith::SubIOp>(make<arith::MaxUIOp>(operand(0), operand(1)),
                               operand(1));
  case llvm::Intrinsic::uadd_sat: {
    Value sum = make<arith::AddIOp>(operand(0), operand(1));
    Value wrapped =
        make<arith::CmpIOp>(arith::CmpIPredicate::ult, sum, operand(0));
    return make<arith::SelectOp>(
        wrapped,
        makeInteger(type,
                    llvm::APInt::getAllOnes(type.getIntOrFloatBitWidth())),
        sum);
  }
  case llvm::Intrinsic::sadd_sat:
  case llvm::Intrinsic::ssub_sat:
    return makeSaturating(call);
  case llvm::Intrinsic::bswap:
    return makeReversal(operand(0), 8);
  case llvm::Intrinsic::bitreverse:
    return makeReversal(operand(0), 1);
  case llvm::Intrinsic::scmp:
    return makeThreeWay(call, /*isSigned=*/true);
  case llvm::Intrinsic::ucmp:
    return makeThreeWay(call, /*isSigned=*/false);
  case llvm::Intrinsic::is_fpclass:
    return makeClassTest(call);
  default:
    return Value();
  }
}
