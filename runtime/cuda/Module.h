// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Module.h - A program's kernels on a CUDA device --------------------===//

#ifndef PIKO_RUNTIME_CUDA_MODULE_H
#define PIKO_RUNTIME_CUDA_MODULE_H

#include "cuda/Device.h"
#include "pikort/grid.h"

#include <string>
#include <unordered_map>

namespace piko::cuda {

class Module {
public:
  /// Nothing is loaded yet. The images live as long as this.
  Module(const Device &device, const pikoir_cuda_image *images)
      : device_(device), images_(images) {}
  Module(const Module &) = delete;
  Module &operator=(const Module &) = delete;

  /// Says of which stage a kernel is, and where that stands.
  void name(const char *kernel, const char *stage, const char *place);
  /// A kernel by its name, of the latest cubin that fits the device, or else of
  /// the PTX; throws Failure. The device must be entered.
  CUfunction find(const std::string &kernel);
  /// Loads the kernels where they are not yet; throws.
  void require() {
    if (!handle_)
      load();
  }
  /// "kernel 'k' of stage 's' (file:line)"
  std::string describe(const std::string &kernel) const;
  /// The device must be entered.
  void unload();

private:
  void load();
  bool loadCubin(const pikoir_cuda_image &image);
  void loadPTX(const void *ptx);

  const Device &device_;
  const pikoir_cuda_image *images_;
  CUmodule handle_ = nullptr;
  std::string refused_; ///< Cubins that fit, and why they are not loaded.
  std::unordered_map<std::string, CUfunction> functions_;
  std::unordered_map<std::string, std::string> origins_; ///< By kernel.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_MODULE_H
