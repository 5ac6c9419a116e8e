// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Kernels of a module, and what ptxas says of them.

#ifndef PIKO_LIB_TARGET_NVPTX_KERNELREPORTS_H
#define PIKO_LIB_TARGET_NVPTX_KERNELREPORTS_H

#include "Piko/Target/KernelResources.h"

namespace piko {

/// Without what only an assembler knows.
std::vector<KernelResources> findKernels(const llvm::Module &module);
/// Adds what `ptxas -v` has printed of some of them.
void readReport(llvm::StringRef report, std::vector<KernelResources> &kernels);

} // namespace piko

#endif // PIKO_LIB_TARGET_NVPTX_KERNELREPORTS_H
