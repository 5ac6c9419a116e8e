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

private:
  void loadModule();
  CUfunction find(const char *kernel);

  pikort_pipeline &p_;
  const char *ptx_;
  std::shared_ptr<Device> device_;
  CUstream stream_ = nullptr;
  CUmodule module_ = nullptr;
  std::unordered_map<std::string, CUfunction> functions_;
  std::span<uint8_t> log_;
  int64_t residentThreads_ = 0;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_ACCELERATOR_H
