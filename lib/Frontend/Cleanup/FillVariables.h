//===- FillVariables.h - Local variables nobody has written -----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// In checking mode, numbers that nobody has written are `piko.undefined`, not
// 0. LLVM may make anything of what is not written, so that it is told of none:
// each local variable gets numbers that no pass knows anything of.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_LIB_FRONTEND_CLEANUP_FILLVARIABLES_H
#define PIKO_LIB_FRONTEND_CLEANUP_FILLVARIABLES_H

#include "Piko/Frontend/Frontend.h"
#include "Support/Memory.h"

namespace piko {

/// The macro PIKO_CHECK asks for checking mode, as it does in plain C++.
bool isChecking(const FrontendOptions &options);

/// A flag of the LLVM module in checking mode.
constexpr llvm::StringLiteral checkingFlag = "piko.checking";

/// Begins the names of functions that give numbers nobody has written.
constexpr llvm::StringLiteral undefinedName = "piko.undefined.";

/// Fills the local variables where their life begins.
void fillVariables(llvm::Function &function, MemoryMap &memory);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_CLEANUP_FILLVARIABLES_H
