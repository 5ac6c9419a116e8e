// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a program brings along for a device to load.

#ifndef PIKO_TARGET_KERNELIMAGES_H
#define PIKO_TARGET_KERNELIMAGES_H

#include "Piko/Driver/GPUOptions.h"

#include "llvm/ADT/STLFunctionalExtras.h"
#include "llvm/IR/Module.h"
#include "llvm/Support/Error.h"

#include <string>

namespace piko {

/// Why there is no cubin for a chip.
struct MissingCubin {
  std::string chip, reason;
  bool isRefused; ///< By an assembler that is there and knows the chip.
};

/// Gives the constant `name`, which the host's code declares, the images of
/// `kernels` as a list of pikoir_cuda_image (pikort/grid.h): a cubin for each
/// chip of `gpu.cubins`, where ptxas is found, and last the PTX for `gpu.chip`.
llvm::Error embedKernels(llvm::Module &host, llvm::Module &kernels,
                         llvm::StringRef name, const GPUOptions &gpu,
                         int optLevel,
                         llvm::function_ref<void(const MissingCubin &)> report);

} // namespace piko

#endif // PIKO_TARGET_KERNELIMAGES_H
