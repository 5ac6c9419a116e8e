// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- OwnKernels.h - The runtime's own kernels on a CUDA device ----------===//

#ifndef PIKO_RUNTIME_CUDA_OWNKERNELS_H
#define PIKO_RUNTIME_CUDA_OWNKERNELS_H

#include "cuda/Module.h"

#include <mutex>
#include <string>
#include <string_view>

namespace piko::cuda {

/// Joins, queues, steps and conditions of loops: a device has one copy of them
/// for all pipelines that are on it, because a driver takes seconds to make
/// code of PTX. Any thread may ask.
class OwnKernels {
public:
  /// Nothing is loaded yet.
  explicit OwnKernels(const Device &device);

  /// Whether a kernel is one of the runtime's, by its name.
  static bool has(std::string_view kernel) {
    return kernel.starts_with("piko_");
  }
  /// A kernel by its name; what it is in is loaded when it is first asked for.
  /// Throws Failure. The device must be entered.
  CUfunction find(const std::string &kernel);
  /// The device must be entered.
  void unload();

private:
  /// Who waits for one is not kept from the others.
  struct Part {
    Module module;
    std::mutex mutex;
  };
  Part joins_, steps_, conditions_;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_OWNKERNELS_H
