// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM IR to PTX, the assembly of NVIDIA's GPUs.

#ifndef PIKO_TARGET_PTX_H
#define PIKO_TARGET_PTX_H

#include "llvm/IR/Module.h"
#include "llvm/Support/Error.h"

#include <string>

namespace piko {

/// Optimises a module of kernels and makes PTX of it for `processor`, such as
/// sm_90 (empty). Arithmetic keeps its bits: nothing is contracted, denormals
/// stay, and divisions and roots are rounded correctly.
llvm::Expected<std::string>
generatePTX(llvm::Module &module, llvm::StringRef processor, int optLevel);

/// How data are laid out in memory, in LLVM's syntax.
std::string getPTXLayout();

/// An error if there is no chip of that name.
llvm::Error checkChip(llvm::StringRef chip);

} // namespace piko

#endif // PIKO_TARGET_PTX_H
