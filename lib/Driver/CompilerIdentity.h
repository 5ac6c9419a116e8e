// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which compiler this is, to the bit.

#ifndef PIKO_LIB_DRIVER_COMPILERIDENTITY_H
#define PIKO_LIB_DRIVER_COMPILERIDENTITY_H

#include <string>

namespace piko {

/// A hash of the libraries that Piko's compiler consists of, whatever tool it
/// is linked to.
extern const char *const compilerBuild;

/// Changes whenever Piko's compiler, LLVM, MLIR or Clang are built anew with
/// other code: that hash, and the build ids of the files that the others were
/// loaded from.
std::string getCompilerIdentity();

} // namespace piko

#endif // PIKO_LIB_DRIVER_COMPILERIDENTITY_H
