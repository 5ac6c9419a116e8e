// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How kernels are mapped to a GPU.

#ifndef PIKO_DRIVER_GPUOPTIONS_H
#define PIKO_DRIVER_GPUOPTIONS_H

#include "piko/macros_begin.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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

/// 10 * major + minor of the compute capability that a chip's name says: 90 for
/// sm_90 and sm_90a; 0 for another name.
inline int32_t getChipNumber(std::string_view name) {
  if (!name.starts_with("sm_"))
    return 0;
  int32_t number = 0;
  const char *end = name.data() + name.size();
  auto [stop, error] = std::from_chars(name.data() + 3, end, number);
  bool isVariant = end - stop == 1 && (*stop == 'a' || *stop == 'f');
  return error == std::errc() && (stop == end || isVariant) ? number : 0;
}

struct GPUOptions {
  /// Threads of a block, a power of two; 0 = as many as the stage has.
  int64_t threads = 0;
  GPUTarget target = GPUTarget::None;
  /// Permutes the blocks of the emulator; 0 = in order.
  int64_t seed = 0;
  /// Most blocks of the emulator's grids; 0 = one for each unit of work.
  int64_t blocks = 0;
  /// Of CUDA: the oldest chip that the PTX is for.
  std::string chip = "sm_70";
  /// Chips that the program brings a cubin for, too, where ptxas is found.
  std::vector<std::string> cubins = {};

  /// Sets both from names between commas; false if one is not that of a chip.
  bool setChips(std::string_view names) {
    cubins.clear();
    for (size_t end = 0; end != names.npos;) {
      end = names.find(',');
      std::string name(names.substr(0, end));
      names.remove_prefix(end == names.npos ? 0 : end + 1);
      if (!getChipNumber(name))
        return false;
      if (cubins.empty() || getChipNumber(name) < getChipNumber(chip))
        chip = name;
      if (std::find(cubins.begin(), cubins.end(), name) == cubins.end())
        cubins.push_back(name);
    }
    return true;
  }
};

} // namespace piko

#include "piko/macros_end.h"

#endif // PIKO_DRIVER_GPUOPTIONS_H
