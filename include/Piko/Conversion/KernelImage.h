// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How the host's code names the kernels that it brings along.

#ifndef PIKO_CONVERSION_KERNELIMAGE_H
#define PIKO_CONVERSION_KERNELIMAGE_H

#include "llvm/ADT/StringRef.h"

#include <string>

namespace piko {

/// The gpu.module of pipeline P is P_gpu.
inline constexpr llvm::StringLiteral kernelsSuffix = "_gpu";

/// The constant that lists what a device may load of a gpu.module, as the
/// runtime's pikoir_cuda_module takes it.
inline std::string getImagesName(llvm::StringRef kernels) {
  return (kernels + ".images").str();
}

} // namespace piko

#endif // PIKO_CONVERSION_KERNELIMAGE_H
