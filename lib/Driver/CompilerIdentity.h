// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which compiler this is, to the bit.

#ifndef PIKO_LIB_DRIVER_COMPILERIDENTITY_H
#define PIKO_LIB_DRIVER_COMPILERIDENTITY_H

#include <string>

namespace piko {

/// Changes whenever Piko's compiler, LLVM, MLIR or Clang are built anew with
/// other code: the build ids of the files that they were loaded from.
std::string getCompilerIdentity();

} // namespace piko

#endif // PIKO_LIB_DRIVER_COMPILERIDENTITY_H
