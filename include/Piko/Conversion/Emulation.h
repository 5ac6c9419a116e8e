// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the host's code and the emulated kernels call each other.

#ifndef PIKO_CONVERSION_EMULATION_H
#define PIKO_CONVERSION_EMULATION_H

#include "llvm/ADT/Twine.h"

namespace piko {

/// The function that runs one thread of a kernel on the CPU: void (const void
/// *)
inline std::string getEmulatedName(llvm::StringRef module,
                                   llvm::StringRef kernel) {
  return (module + "." + kernel + ".emulated").str();
}

} // namespace piko

#endif // PIKO_CONVERSION_EMULATION_H
