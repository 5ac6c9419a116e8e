// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How kernels are mapped to a GPU.

#ifndef PIKO_DRIVER_GPUOPTIONS_H
#define PIKO_DRIVER_GPUOPTIONS_H

#include <cstdint>

namespace piko {

struct GPUOptions {
  /// Threads of a block, a power of two; 0 = as many as the stage has.
  int64_t threads = 0;
  /// Runs kernels for a GPU on the CPU (--target gpu-on-cpu): blocks one after
  /// the other, their threads by turns.
  bool emulate = false;
  /// Permutes the blocks then; 0 = in order.
  int64_t seed = 0;
};

} // namespace piko

#endif // PIKO_DRIVER_GPUOPTIONS_H
