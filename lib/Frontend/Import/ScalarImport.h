//===- ScalarImport.h - Numbers from LLVM IR to arith -----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_IMPORT_SCALARIMPORT_H
#define PIKO_LIB_FRONTEND_IMPORT_SCALARIMPORT_H

#include "Piko/Frontend/PipelineDescription.h"
#include "mlir/IR/Builders.h"
#include "llvm/ADT/DenseMap.h"
#include "llvm/IR/InstrTypes.h"
#include "llvm/IR/IntrinsicInst.h"

namespace piko {

/// The type of a leaf field's numbers.
mlir::Type getScalarType(mlir::Builder &builder, ScalarType type);

using ValueMap = llvm::DenseMap<llvm::Value *, mlir::Value>;

/// Writes instructions on numbers in arith and math. What LLVM leaves open is
/// pinned down: conversions to integers saturate and NaN gives 0, and values
/// that nobody has set are 0.
class ScalarImporter {
public:
  ScalarImporter(mlir::OpBuilder &builder, ValueMap &values)
      : builder(builder), values(values) {}

  void setEntry(mlir::Block *block) { entry = block; }
  void setLocation(mlir::Location at) { location = at; }

  /// The value of an instruction; null if it is not one on numbers.
  mlir::Value import(llvm::Instruction *instruction);

  /// The value of an operand, constants included.
  mlir::Value get(llvm::Value *value);
  /// The same for a cell coordinate, in the type that C++ computed it in.
  mlir::Value getCoordinate(llvm::Value *value);

  mlir::Type getType(llvm::Type *type);
  mlir::Type getType(ScalarType type);

  mlir::Value makeIndex(int64_t value);
  mlir::Value toIndex(mlir::Value value);
  mlir::Value fromIndex(mlir::Value index, mlir::Type type);

private:
  mlir::Value importBinary(llvm::Instruction *instruction);
  mlir::Value importCast(llvm::Instruction *instruction);
  mlir::Value importCompare(llvm::CmpInst *compare);
  mlir::Value importIntrinsic(llvm::IntrinsicInst *call);
  mlir::Value importOverflow(llvm::Instruction *extract);
  mlir::Value makeOverflow(llvm::Intrinsic::ID id, mlir::Value a,
                           mlir::Value b);
  mlir::Value makeFunnelShift(llvm::IntrinsicInst *call, bool left);
  mlir::Value makeClassTest(llvm::IntrinsicInst *call);
  mlir::Value makeClassTestByBits(mlir::Value value, llvm::FPClassTest classes);
  mlir::Value makeSaturating(llvm::IntrinsicInst *call);
  mlir::Value makeReversal(mlir::Value value, unsigned from);
  mlir::Value makeThreeWay(llvm::IntrinsicInst *call, bool isSigned);
  mlir::Value convertToInteger(mlir::Value value, mlir::Type type,
                               bool isSigned);
  mlir::Value makeConstant(llvm::Constant *constant);
  mlir::Value makeInteger(mlir::Type type, const llvm::APInt &value);

  template <typename OpT, typename... Args> mlir::Value make(Args &&...args) {
    return OpT::create(builder, *location, std::forward<Args>(args)...);
  }

  mlir::OpBuilder &builder;
  ValueMap &values;
  mlir::Block *entry = nullptr;
  std::optional<mlir::Location> location;
};

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_SCALARIMPORT_H
