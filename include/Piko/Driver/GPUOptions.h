// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How kernels are mapped to a GPU.

#ifndef PIKO_DRIVER_GPUOPTIONS_H
#define PIKO_DRIVER_GPUOPTIONS_H

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace piko {

/// What runs the kernels for a GPU.
enum class GPUTarget {
  None,     ///< Nothing: they are for a CPU.
  Emulator, ///< --target gpu-on-cpu: blocks one after the other, their threads
            ///< by turns.
  CUDA, ///< --target cuda: a device, from PTX that the program brings along.
  Auto  ///< --target auto: CUDA where there is a device, else the CPU. Only
        ///< compileObject() takes it.
};

/// The target of that name, or nothing.
inline std::optional<GPUTarget> parseGPUTarget(std::string_view name) {
  if (name == "cpu")
    return GPUTarget::None;
  if (name == "gpu-on-cpu")
    return GPUTarget::Emulator;
  if (name == "cuda")
    return GPUTarget::CUDA;
  if (name == "auto")
    return GPUTarget::Auto;
  return std::nullopt;
}

struct GPUOptions {
  /// Threads of a block, a power of two; 0 = as many as the stage has.
  int64_t threads = 0;
  GPUTarget target = GPUTarget::None;
  /// Permutes the blocks of the emulator; 0 = in order.
  int64_t seed = 0;
  /// Of CUDA: the oldest chip that the PTX is for.
  std::string chip = "sm_70";
};

} // namespace piko

#endif // PIKO_DRIVER_GPUOPTIONS_H
