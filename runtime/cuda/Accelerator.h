// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Accelerator.h - A pipeline's part of a CUDA device -----------------===//
//
// Memory of the device is allocated there, and copied to and from; memory of
// the host that kernels reach is page-locked. None is managed: where that is
// more than a card has, pages move in every frame, and a card can hang.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_ACCELERATOR_H
#define PIKO_RUNTIME_CUDA_ACCELERATOR_H

#include "common/Accelerator.h"
#include "cuda/Module.h"
#include "cuda/Submission.h"
#include "cuda/frame/Frame.h"

#include <string>
#include <unordered_map>

struct pikort_pipeline;

namespace piko::cuda {

class Accelerator final : public rt::Accelerator {
public:
  /// The images live as long as the program; throws Failure.
  Accelerator(pikort_pipeline &p, const pikoir_cuda_image *images);
  ~Accelerator() override;

  int32_t number() const override { return device_->ordinal; }
  void checkAlive() const override { device_->checkAlive(); }
  uint8_t *map(size_t bytes) noexcept override;
  void unmap(uint8_t *data) noexcept override;
  uint8_t *allocate(size_t bytes) noexcept override;
  void release(uint8_t *data) noexcept override;
  std::span<uint8_t> logSpace() noexcept override;
  /// For the next frame, which is to find more there.
  void growLog() { wantedLog_ = 2 * log_.size(); }
  void checkMemory(const std::string &who, const void *address,
                   int64_t bytes) const override {
    device_->checkMemory(who, reinterpret_cast<CUdeviceptr>(address), bytes);
  }
  void checkHosts(const std::string &who, const void *data) const override {
    device_->checkHosts(who, data);
  }
  void useStream(void *stream, bool waits) override;
  void finishStream() override;
  void endStream() noexcept override;
  void upload(uint8_t *to, const uint8_t *from, int64_t bytes) override;
  void copy(uint8_t *to, const uint8_t *from, int64_t bytes) override;
  void download(uint8_t *to, const uint8_t *from, int64_t bytes) override;
  void clear(uint8_t *data, int64_t bytes) override;
  int64_t residentThreads() const override { return residentThreads_; }
  void launch(const char *kernel, int64_t blocks, int64_t threads,
              const void *arguments, int64_t count) override;

  /// Whether blocks of a grid can wait for each other, as joins do.
  bool canWaitInGrids() const;
  /// How many blocks of a kernel, each of that many threads, are resident at a
  /// time; at least 1.
  int64_t residentBlocks(const std::string &kernel, int64_t threads);
  /// Blocks of a join, all of which are resident.
  int64_t joinBlocks(const std::string &kernel);
  /// Up to how much work its first block does by itself (device/Grid.h).
  int64_t mostAlone() const { return mostAlone_; }
  /// Gives the stream what the steps say; throws.
  void enqueue(std::span<const Step> steps);
  /// The same between copies of what host and device say, back to where `end`
  /// is.
  void enqueue(std::span<const Step> steps, const Exchange &exchange,
               const void *end);
  /// Whether that has ended.
  bool isDone() const;
  /// Waits for it; throws.
  void await(std::span<const Step> steps);
  /// Memory of the host in which joins say how far a submission is; throws.
  int64_t *progress();

  void loadKernels() override;
  /// Of a kernel, for messages.
  void name(const char *kernel, const char *stage, const char *place) {
    module_.name(kernel, stage, place);
  }

private:
  friend class Submission;
  /// A kernel of the program's or the runtime's, loaded; throws.
  CUfunction find(const std::string &kernel);
  /// Throws unless they can run.
  void load(std::span<const Step> steps);
  void launch(const GridLaunch &grid, CUstream stream);
  /// Of a frame: what the device has there when its stream has ended; throws.
  int32_t read(const int32_t *data);
  /// After what the stream has been given.
  void noteEnd();
  uint8_t *allocated(CUresult result, CUdeviceptr address, size_t bytes);
  /// For all that is in the stream; throws.
  void wait(std::span<const Step> steps);
  void leaveStream();
  /// The kernel of a submission that failed, as far as it is known.
  std::string describeFailed(std::span<const Step> steps);

  pikort_pipeline &p_;
  std::shared_ptr<Device> device_;
  Module module_; ///< The program's kernels.
  /// Of the runtime's kernels those that were asked for: no lock for each
  /// launch.
  std::unordered_map<std::string, CUfunction> ownFunctions_;
  CUstream own_ = nullptr;
  CUstream stream_ = nullptr; ///< Of the run; the host's, or our own.
  CUevent done_ = nullptr;    ///< After a frame that is not waited for.
  bool usesEvent_ = false;    ///< To wait for the run.
  bool isBusy_ = false;       ///< The stream may have something to do for it.
  Submission submission_{*this, *device_};
  std::span<uint8_t> log_;
  size_t wantedLog_ = 0;
  std::vector<uint8_t *> unreleased_; ///< The driver has refused to free it.
  int64_t *progress_ = nullptr;       ///< And room for what the host reads.
  int64_t processors_ = 0, residentThreads_ = 0, mostAlone_ = 0;
  std::unordered_map<std::string, int64_t> residentBlocks_; ///< By kernel.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_ACCELERATOR_H
