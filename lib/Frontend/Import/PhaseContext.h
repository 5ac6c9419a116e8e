//===- PhaseContext.h - What importers of a phase share ---------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_IMPORT_PHASECONTEXT_H
#define PIKO_LIB_FRONTEND_IMPORT_PHASECONTEXT_H

#include "Import/Import.h"
#include "Import/ScalarImport.h"
#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// The phase, what is known of its values, and how errors are told.
class PhaseContext {
protected:
  PhaseContext(llvm::Function &source, WrapperKind phase, unsigned stage,
               ParsedUnit &unit, MemoryMap &memory, mlir::MLIRContext &context);

  mlir::InFlightDiagnostic fail(const llvm::Instruction *instruction);
  llvm::LogicalResult reject(const llvm::Instruction *instruction,
                             const llvm::Twine &what);
  /// Reports what is for another phase.
  llvm::LogicalResult expectPhase(const llvm::Instruction *instruction,
                                  WrapperKind expected, llvm::StringRef what);
  void setLocation(const llvm::Instruction *instruction);

  int64_t getRank() const { return unit.pipeline.rank; }
  llvm::LogicalResult setIndex(llvm::CallInst *call, mlir::Value index);
  mlir::Value getIndex(llvm::CallInst *call, unsigned operand);
  static int64_t getConstant(llvm::CallInst *call, unsigned operand);

  template <typename OpT, typename... Args> OpT make(Args &&...args) {
    return OpT::create(builder, *location, std::forward<Args>(args)...);
  }
  /// What begins a region of an operation, which is made later.
  mlir::func::CallOp makePlaceholder(llvm::StringRef name, llvm::CallInst *call,
                                     unsigned count);

  llvm::Function &source;
  WrapperKind phase;
  const StageDescription &stage;
  ParsedUnit &unit;
  MemoryMap &memory;
  mlir::MLIRContext &context;
  mlir::OpBuilder builder;
  ValueMap values;
  ScalarImporter scalars;
  std::optional<mlir::Location> location;
  mlir::Block *entry = nullptr;
  /// The first block of the loop of that number.
  llvm::DenseMap<int64_t, mlir::Block *> loopEntries;
  llvm::DenseMap<llvm::CallInst *, mlir::func::CallOp> placeholders;
};

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_PHASECONTEXT_H
