//===- ScalarImport.cpp - Numbers from LLVM IR to arith -------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

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

//===----------------------------------------------------------------------===//
// Types, constants, indices
//===----------------------------------------------------------------------===//

Type ScalarImporter::getType(llvm::Type *type) {
  if (type->isFloatTy())
    return builder.getF32Type();
  if (type->isDoubleTy())
    return builder.getF64Type();
  if (type->isHalfTy())
    return builder.getF16Type();
  if (type->isIntegerTy())
    return builder.getIntegerType(type->getIntegerBitWidth());
  return Type();
}

Type piko::getScalarType(mlir::Builder &builder, ScalarType type) {
  switch (type) {
  case ScalarType::F32:
    return builder.getF32Type();
  case ScalarType::F64:
    return builder.getF64Type();
  case ScalarType::I8:
    return builder.getI8Type();
  case ScalarType::I16:
    return builder.getI16Type();
  case ScalarType::I32:
    return builder.getI32Type();
  case ScalarType::I64:
    return builder.getI64Type();
  }
  llvm_unreachable("all scalar types are listed");
}

Type ScalarImporter::getType(ScalarType type) {
  return getScalarType(builder, type);
}

Value ScalarImporter::makeInteger(Type type, const llvm::APInt &value) {
  return make<arith::ConstantOp>(builder.getIntegerAttr(type, value));
}

Value ScalarImporter::makeConstant(llvm::Constant *constant) {
  Type type = getType(constant->getType());
  if (!type)
    return Value();
  if (auto *number = dyn_cast<llvm::ConstantInt>(constant))
    return makeInteger(type, number->getValue());
  if (auto *number = dyn_cast<llvm::ConstantFP>(constant))
    return make<arith::ConstantOp>(
        builder.getFloatAttr(type, number->getValueAPF()));
  // undef and poison
  return make<arith::ConstantOp>(builder.getZeroAttr(type));
}

Value ScalarImporter::get(llvm::Value *value) {
  if (auto *constant = dyn_cast<llvm::Constant>(value))
    return makeConstant(constant);
  return values.lookup(value);
}

Value ScalarImporter::getCoordinate(llvm::Value *value) {
  if (auto *constant = dyn_cast<llvm::ConstantInt>(value))
    return makeIndex(constant->getSExtValue());
  if (auto *extension = dyn_cast<llvm::SExtInst>(value))
    if (extension->getSrcTy()->isIntegerTy(32))
      return get(extension->getOperand(0));
  return get(value);
}

Value ScalarImporter::makeIndex(int64_t value) {
  return make<arith::ConstantIndexOp>(value);
}

Value ScalarImporter::toIndex(Value value) {
  if (mlir::isa<mlir::IndexType>(value.getType()))
    return value;
  if (auto cast = value.getDefiningOp<arith::IndexCastOp>())
    if (value.getType().isInteger(64))
      return cast.getIn();
  return make<arith::IndexCastOp>(builder.getIndexType(), value);
}

Value ScalarImporter::fromIndex(Value index, Type type) {
  return make<arith::IndexCastOp>(type, index);
}

//===----------------------------------------------------------------------===//
// Instructions
//===----------------------------------------------------------------------===//

Value ScalarImporter::import(llvm::Instruction *instruction) {
  if (!getType(instruction->getType()))
    return Value();
  for (llvm::Value *operand : instruction->operands())
    if (operand->getType()->isPointerTy() &&
        !llvm::isa<llvm::CallBase>(instruction))
      return Value();
  if (instruction->isBinaryOp())
    return importBinary(instruction);
  if (instruction->isCast())
    return importCast(instruction);
  if (auto *compare = dyn_cast<llvm::CmpInst>(instruction))
    return importCompare(compare);
  switch (instruction->getOpcode()) {
  case llvm::Instruction::FNeg:
    return make<arith::NegFOp>(get(instruction->getOperand(0)));
  case llvm::Instruction::Freeze:
    return get(instruction->getOperand(0));
  case llvm::Instruction::Select:
    return make<arith::SelectOp>(get(instruction->getOperand(0)),
                                 get(instruction->getOperand(1)),
                                 get(instruction->getOperand(2)));
  case llvm::Instruction::ExtractValue:
    return importOverflow(instruction);
  default:
    break;
  }
  if (auto *call = dyn_cast<llvm::IntrinsicInst>(instruction))
    return importIntrinsic(call);
  return Value();
}

Value ScalarImporter::importBinary(llvm::Instruction *instruction) {
  Value a = get(instruction->getOperand(0));
  Value b = get(instruction->getOperand(1));
  switch (instruction->getOpcode()) {
#define BINARY(OPCODE, OP)                                                     \
  case llvm::Instruction::OPCODE:                                              \
    return make<arith::OP>(a, b);
    BINARY(Add, AddIOp)
    BINARY(Sub, SubIOp)
    BINARY(Mul, MulIOp)
    BINARY(SDiv, DivSIOp)
    BINARY(UDiv, DivUIOp)
    BINARY(SRem, RemSIOp)
    BINARY(URem, RemUIOp)
    BINARY(And, AndIOp)
    BINARY(Or, OrIOp)
    BINARY(Xor, XOrIOp)
    BINARY(Shl, ShLIOp)
    BINARY(LShr, ShRUIOp)
    BINARY(AShr, ShRSIOp)
    BINARY(FAdd, AddFOp)
    BINARY(FSub, SubFOp)
    BINARY(FMul, MulFOp)
    BINARY(FDiv, DivFOp)
    BINARY(FRem, RemFOp)
#undef BINARY
  default:
    return Value();
  }
}

Value ScalarImporter::importCast(llvm::Instruction *instruction) {
  Value value = get(instruction->getOperand(0));
  Type type = getType(instruction->getType());
  if (!value)
    return Value();
  switch (instruction->getOpcode()) {
  case llvm::Instruction::Trunc:
    return make<arith::TruncIOp>(type, value);
  case llvm::Instruction::ZExt:
    return make<arith::ExtUIOp>(type, value);
  case llvm::Instruction::SExt:
    return make<arith::ExtSIOp>(type, value);
  case llvm::Instruction::FPTrunc:
    return make<arith::TruncFOp>(type, value);
  case llvm::Instruction::FPExt:
    return make<arith::ExtFOp>(type, value);
  case llvm::Instruction::SIToFP:
    return make<arith::SIToFPOp>(type, value);
  case llvm::Instruction::UIToFP:
    return make<arith::UIToFPOp>(type, value);
  case llvm::Instruction::FPToSI:
    return convertToInteger(value, type, /*isSigned=*/true);
  case llvm::Instruction::FPToUI:
    return convertToInteger(value, type, /*isSigned=*/false);
  case llvm::Instruction::BitCast:
    return make<arith::BitcastOp>(type, value);
  default:
    return Value();
  }
}

/// Saturates; NaN gives 0.
Value ScalarImporter::convertToInteger(Value value, Type type, bool isSigned) {
  unsigned bits = type.getIntOrFloatBitWidth();
  llvm::APInt lowest = isSigned ? llvm::APInt::getSignedMinValue(bits)
                                : llvm::APInt::getMinValue(bits);
  llvm::APInt highest = isSigned ? llvm::APInt::getSignedMaxValue(bits)
                                 : llvm::APInt::getMaxValue(bits);
  auto floatType = cast<mlir::FloatType>(value.getType());
  // The power of two above the highest integer is a float; that below the
  // lowest, or 0, is one too.
  llvm::APFloat above(floatType.getFloatSemantics(), 1),
      below(floatType.getFloatSemantics());
  above = llvm::scalbn(above, bits - (isSigned ? 1 : 0),
                       llvm::APFloat::rmNearestTiesToEven);
  below.convertFromAPInt(lowest, isSigned, llvm::APFloat::rmNearestTiesToEven);

  Value converted = isSigned ? make<arith::FPToSIOp>(type, value)
                             : make<arith::FPToUIOp>(type, value);
  auto compare = [&](arith::CmpFPredicate predicate,
                     const llvm::APFloat &bound) {
    return make<arith::CmpFOp>(
        predicate, value,
        make<arith::ConstantOp>(builder.getFloatAttr(floatType, bound)));
  };
  Value tooHigh = compare(arith::CmpFPredicate::OGE, above);
  Value tooLow = compare(arith::CmpFPredicate::OLT, below);
  Value isNaN = make<arith::CmpFOp>(arith::CmpFPredicate::UNO, value, value);
  Value result =
      make<arith::SelectOp>(tooHigh, makeInteger(type, highest), converted);
  result = make<arith::SelectOp>(tooLow, makeInteger(type, lowest), result);
  return make<arith::SelectOp>(
      isNaN, makeInteger(type, llvm::APInt::getZero(bits)), result);
}

Value ScalarImporter::importCompare(llvm::CmpInst *compare) {
  Value a = get(compare->getOperand(0)), b = get(compare->getOperand(1));
  using P = llvm::CmpInst::Predicate;
  switch (compare->getPredicate()) {
#define FLOAT(FROM, TO)                                                        \
  case P::FROM:                                                                \
    return make<arith::CmpFOp>(arith::CmpFPredicate::TO, a, b);
    FLOAT(FCMP_FALSE, AlwaysFalse)
    FLOAT(FCMP_OEQ, OEQ)
    FLOAT(FCMP_OGT, OGT)
    FLOAT(FCMP_OGE, OGE)
    FLOAT(FCMP_OLT, OLT)
    FLOAT(FCMP_OLE, OLE)
    FLOAT(FCMP_ONE, ONE)
    FLOAT(FCMP_ORD, ORD)
    FLOAT(FCMP_UNO, UNO)
    FLOAT(FCMP_UEQ, UEQ)
    FLOAT(FCMP_UGT, UGT)
    FLOAT(FCMP_UGE, UGE)
    FLOAT(FCMP_ULT, ULT)
    FLOAT(FCMP_ULE, ULE)
    FLOAT(FCMP_UNE, UNE)
    FLOAT(FCMP_TRUE, AlwaysTrue)
#undef FLOAT
#define INTEGER(FROM, TO)                                                      \
  case P::FROM:                                                                \
    return make<arith::CmpIOp>(arith::CmpIPredicate::TO, a, b);
    INTEGER(ICMP_EQ, eq)
    INTEGER(ICMP_NE, ne)
    INTEGER(ICMP_SLT, slt)
    INTEGER(ICMP_SLE, sle)
    INTEGER(ICMP_SGT, sgt)
    INTEGER(ICMP_SGE, sge)
    INTEGER(ICMP_ULT, ult)
    INTEGER(ICMP_ULE, ule)
    INTEGER(ICMP_UGT, ugt)
    INTEGER(ICMP_UGE, uge)
#undef INTEGER
  default:
    return Value();
  }
}

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

//===----------------------------------------------------------------------===//
// Intrinsics
//===----------------------------------------------------------------------===//

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
