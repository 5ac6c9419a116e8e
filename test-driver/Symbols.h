// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Symbols.h - The driver's functions that the library exports --------===//

#ifndef PIKO_TEST_DRIVER_SYMBOLS_H
#define PIKO_TEST_DRIVER_SYMBOLS_H

#include "cuda/DriverAPI.h"

namespace piko::cuda {
#define PIKO_CUDA_FUNCTION(NAME, SYMBOL, PARAMETERS)                           \
  extern "C"                                                                   \
      [[gnu::visibility("default")]] CUresult NAME PARAMETERS __asm__(SYMBOL);
#define PIKO_CUDA_OPTIONAL PIKO_CUDA_FUNCTION
#include "cuda/DriverAPI.def"
} // namespace piko::cuda

#endif // PIKO_TEST_DRIVER_SYMBOLS_H
