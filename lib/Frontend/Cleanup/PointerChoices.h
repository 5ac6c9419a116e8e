//===- PointerChoices.h - Phis and selects of pointers ----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#ifndef PIKO_LIB_FRONTEND_CLEANUP_POINTERCHOICES_H
#define PIKO_LIB_FRONTEND_CLEANUP_POINTERCHOICES_H

#include "Support/Memory.h"

namespace piko {

inline bool isPointerChoice(const llvm::Value *value) {
  return value->getType()->isPointerTy() &&
         llvm::isa<llvm::PHINode, llvm::SelectInst>(value);
}

/// What a choice chooses from.
inline auto getChoiceOperands(llvm::Value *choice) {
  unsigned begin = llvm::isa<llvm::SelectInst>(choice) ? 1 : 0;
  return llvm::drop_begin(llvm::cast<llvm::User>(choice)->operands(), begin);
}

/// A pointer that walks through memory becomes an index; whether there was one.
bool indexPointers(llvm::Function &function, MemoryMap &memory);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_CLEANUP_POINTERCHOICES_H
