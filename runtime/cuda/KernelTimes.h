// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- KernelTimes.h - What grids of a frame take -------------------------===//
//
// Grids that are launched one by one have events between them. What a grid
// takes is the time from one event to the next, on the device's own clock.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_KERNELTIMES_H
#define PIKO_RUNTIME_CUDA_KERNELTIMES_H

#include "cuda/Device.h"

#include <vector>

namespace piko::rt {
struct KernelStats;
} // namespace piko::rt

namespace piko::cuda {

class KernelTimes {
public:
  explicit KernelTimes(const Device &device) : device_(device) {}
  KernelTimes(const KernelTimes &) = delete;
  KernelTimes &operator=(const KernelTimes &) = delete;

  /// Before grids that follow each other; throws.
  void begin(CUstream stream);
  /// After one, of a kernel of the pipeline's (-1: of none), or of the
  /// runtime's for it; throws.
  void note(CUstream stream, int32_t kernel, bool isJoin);
  /// When the stream has come to their end: adds their times; throws.
  void add(std::vector<rt::KernelStats> &stats);
  /// Frees the events; the device must be entered.
  void end() noexcept;

private:
  struct TimedGrid {
    int32_t kernel;
    bool isJoin;
  };
  void record(CUstream stream);

  const Device &device_;
  std::vector<CUevent> events_;
  size_t used_ = 0;              ///< Events: one more than there are grids.
  std::vector<TimedGrid> grids_; ///< Since begin().
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_KERNELTIMES_H
