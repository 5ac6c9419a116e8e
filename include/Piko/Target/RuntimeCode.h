// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Functions of the runtime that programs have inline: C++ of runtime/inline,
// which a build of the compiler makes LLVM's bitcode of.

#ifndef PIKO_TARGET_RUNTIMECODE_H
#define PIKO_TARGET_RUNTIMECODE_H

#include "llvm/IR/Module.h"
#include "llvm/Support/Error.h"

namespace piko {

/// Whose functions a module may call: a CPU's, or those of a GPU's kernels.
enum class RuntimeCode : uint8_t { CPU, GPU };

/// Inlines the runtime's functions of that kind that a module declares, and
/// drops the declarations. An error if kernels declare one that there is not.
llvm::Error inlineRuntimeCode(llvm::Module &module, RuntimeCode kind);

} // namespace piko

#endif // PIKO_TARGET_RUNTIMECODE_H
