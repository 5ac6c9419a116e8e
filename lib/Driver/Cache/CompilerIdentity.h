// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which compiler this is, to the bit.

#ifndef PIKO_LIB_DRIVER_COMPILERIDENTITY_H
#define PIKO_LIB_DRIVER_COMPILERIDENTITY_H

#include <string>

namespace piko {

/// How much of the compiler decides what is made.
enum class CompilerPart {
  Clang, ///< Clang and LLVM, how they are called, and what becomes of what
         ///< they make without a pass of Piko's: precompiled headers, and the
         ///< reference executor.
  Frontend, ///< That, MLIR, and what makes the dialect of C++.
  All
};

/// Hashes of the sources that call Clang, of the frontend's libraries, and of
/// all that Piko's compiler consists of, whatever tool it is linked to.
extern const char *const clangCalls, *const frontendBuild, *const compilerBuild;

/// Changes whenever that part of Piko's compiler, LLVM, MLIR or Clang are built
/// anew with other code: that hash, and the build ids of the files that the
/// others were loaded from.
std::string getCompilerIdentity(CompilerPart part);

} // namespace piko

#endif // PIKO_LIB_DRIVER_COMPILERIDENTITY_H
