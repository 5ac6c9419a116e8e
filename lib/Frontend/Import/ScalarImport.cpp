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
