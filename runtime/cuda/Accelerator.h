// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Accelerator.h - A pipeline's part of a CUDA device -----------------===//
//
// Memory is managed memory: one address on both sides, and pages that move to
// who touches them, or stay where only one does.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_ACCELERATOR_H
#define PIKO_RUNTIME_CUDA_ACCELERATOR_H

#include "common/Accelerator.h"
#include "cuda/Device.h"
#include "cuda/Frame.h"

#include <string>
#include <unordered_map>

struct pikort_pipeline;

namespace piko::cuda {

class Accelerator final : public rt::Accelerator {
public:
  /// `ptx` ends with a zero byte, and lives as long as the program; throws
  /// Failure.
  Accelerator(pikort_pipeline &p, const char *ptx);
  ~Accelerator() override;

  uint8_t *map(size_t bytes) noexcept override;
  void unmap(uint8_t *data) noexcept override;
  std::span<uint8_t> logSpace() noexcept override;
  void clearLog(std::span<uint8_t> part) noexcept override;
  int64_t residentThreads() const override { return residentThreads_; }
  void launch(const char *kernel, int64_t blocks, int64_t threads,
              const void *arguments, int64_t count) override;
  std::unique_ptr<rt::DeviceFrame> makeFrame() override;

  /// Whether blocks of a grid can wait for each other, as joins do.
  bool canWaitInGrids() const;
  /// Blocks of a join, all of which are resident.
  int64_t joinBlocks() const { return joinBlocks_; }
  /// Runs grids one after the other, behind making a part of the log zero
  /// again, and waits for them; throws.
  void submit(std::span<const GridLaunch> grids, std::span<uint8_t> clear);
  /// Memory of the host in which joins say how far a submission is; throws.
  int64_t *progress();

private:
  void loadModules();
  CUmodule load(const char *ptx);
  CUfunction find(const std::string &kernel);
  void launch(const GridLaunch &grid);
  /// The kernel of a submission that failed, as far as it is known.
  std::string findFailed(std::span<const GridLaunch> grids) const;

  pikort_pipeline &p_;
  const char *ptx_;
  std::shared_ptr<Device> device_;
  CUstream stream_ = nullptr;
  CUmodule module_ = nullptr, joins_ = nullptr;
  std::unordered_map<std::string, CUfunction> functions_;
  std::span<uint8_t> log_;
  int64_t *progress_ = nullptr;
  int64_t residentThreads_ = 0, joinBlocks_ = 0;
  Frame *frame_ = nullptr; ///< The executor's, which ends first.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_ACCELERATOR_H
