// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Kernels for a GPU as code for the CPU.

#ifndef PIKO_TARGET_EMULATE_H
#define PIKO_TARGET_EMULATE_H

#include "llvm/IR/Module.h"
#include "llvm/Support/Error.h"

namespace piko {

/// Links the LLVM IR of a `gpu.module` of that name into the host's module:
/// intrinsics of NVPTX become calls of the emulator, and each kernel gets the
/// function that the emulator calls for a thread.
llvm::Error linkEmulatedKernels(llvm::Module &host,
                                std::unique_ptr<llvm::Module> kernels,
                                llvm::StringRef name);

} // namespace piko

#endif // PIKO_TARGET_EMULATE_H
