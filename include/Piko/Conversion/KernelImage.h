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

/// The constant that holds what a device loads: the PTX of a gpu.module, which
/// ends with a zero byte.
inline std::string getImageName(llvm::StringRef kernels) {
  return (kernels + ".ptx").str();
}

} // namespace piko

#endif // PIKO_CONVERSION_KERNELIMAGE_H
