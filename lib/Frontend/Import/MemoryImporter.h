//===- MemoryImporter.h - Local arrays, state and primitives ----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_IMPORT_MEMORYIMPORTER_H
#define PIKO_LIB_FRONTEND_IMPORT_MEMORYIMPORTER_H

#include "Import/PhaseContext.h"

namespace piko {

/// Whether an instruction asks where a pointer points to.
inline bool isPlaceUse(const llvm::Instruction *instruction) {
  return llvm::isa<llvm::PtrToIntInst>(instruction) ||
         (llvm::isa<llvm::ICmpInst>(instruction) &&
          instruction->getOperand(0)->getType()->isPointerTy());
}
constexpr llvm::StringLiteral comparedPlaces =
    "comparing or subtracting pointers that are not known to point into one "
    "array; compare indices";

class MemoryImporter : protected PhaseContext {
protected:
  using PhaseContext::PhaseContext;

  llvm::LogicalResult importArray(llvm::AllocaInst *variable);
  llvm::LogicalResult importArrayAccess(llvm::Instruction *instruction);
  llvm::LogicalResult importDivision(llvm::CallInst *call, unsigned opcode);
  llvm::LogicalResult importAccessor(llvm::CallInst *call,
                                     llvm::StringRef name);
  llvm::LogicalResult importUpdateBegin(llvm::CallInst *call);
  llvm::LogicalResult importEmit(llvm::CallInst *call);
  const StateDescription *getState(llvm::CallInst *user, llvm::Value *handle);
  llvm::SmallVector<mlir::Value>
  getCoordinates(llvm::iterator_range<llvm::User::op_iterator> operands,
                 int64_t rank);

private:
  struct MemoryPlace {
    const StateDescription *state = nullptr; ///< null = a primitive
    mlir::Value prim;
    llvm::SmallVector<mlir::Value> indices, elements;
    llvm::StringRef field;
  };
  llvm::LogicalResult rejectVariable(llvm::AllocaInst *variable);
  llvm::LogicalResult checkLocalSize(llvm::AllocaInst *variable);
  mlir::Value makeElementIndex(const Address &address, int64_t size);
  llvm::LogicalResult getPlace(llvm::CallInst *call, unsigned firstElement,
                               MemoryPlace &place);
  llvm::LogicalResult importLoad(llvm::CallInst *call);
  llvm::LogicalResult importStore(llvm::CallInst *call);
  /// For an atomic that shows the order of primitives.
  llvm::LogicalResult expectUnordered(llvm::CallInst *call, bool isFetch);
  llvm::LogicalResult importAtomic(llvm::CallInst *call);
  llvm::DenseMap<llvm::Value *, mlir::Value> arrays;
  int64_t localBytes = 0; ///< Of all arrays.
};

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_MEMORYIMPORTER_H
