// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Frame.h - A pipeline's frame as one submission ---------------------===//
//
// What a program does is a table of steps (pikort/grid.h), of which a frame
// makes what is submitted. Before each kernel goes a join
// (device/Joins.h), which finds its input and its units. Grids have as many
// blocks as fill the device, and go over the units that they find. Memory is
// taken from the pipeline's log space, in address order, from the first kernel
// to the last; strips take it again. What host and device say to each other is
// in an Exchange: the frame writes the host's copy of it, in which all
// addresses are the device's.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_FRAME_H
#define PIKO_RUNTIME_CUDA_FRAME_H

#include "cuda/frame/FrameDescription.h"

#include <string>

namespace piko::cuda {

/// Between the positions of a loop that has a stack (device/Step.cpp).
inline constexpr const char *stepKernel = "piko_step";

/// A grid to launch; `arguments` are words of eight bytes.
struct GridLaunch {
  std::string kernel;
  int64_t blocks, threads;
  std::vector<int64_t> arguments;
  bool isJoin; ///< Of the runtime's own kernels; its blocks meet at barriers.
  bool operator==(const GridLaunch &) const = default;
};

/// What a submission does: launches grids, some of them repeatedly.
struct Step {
  enum class Kind {
    Grid,
    Repeat, ///< What follows, until its end, at least once, ...
    End     ///< ... and as long as `again` is not zero then.
  };
  Kind kind;
  GridLaunch grid;
  const int32_t *again = nullptr; ///< Where the device sees it.
  int32_t timed = -1; ///< The kernel of the pipeline's whose time a grid is.
  bool operator==(const Step &) const = default;
};

class DeviceFrame : private FrameDescription {
public:
  DeviceFrame(pikort_pipeline &p, Accelerator &device)
      : FrameDescription(p, device) {}

  /// Whether the device can run all of it, as far as is known: the pipeline, or
  /// this run of it, may need the host between its kernels.
  bool isPossible() const;
  /// Makes of a program what is to be submitted, with strips of these sizes, in
  /// primitives, by number of their groups. Nothing runs yet. Throws, or sets
  /// the pipeline's status.
  void record(Steps program, std::span<const int64_t> stripSizes);
  enum class Outcome {
    Done,
    Repeat, ///< Memory or a rule: the host is to take the run step by step.
    Spoilt  ///< The same, but state that was to stay has changed.
  };
  /// Submits what was recorded; false, and nothing runs, if the host is to take
  /// the run step by step. Throws.
  bool submit();
  /// Whether it has ended; throws.
  bool isDone() const;
  /// Waits for it; throws.
  Outcome await();

private:
  /// The queues of what the kernel at a place of the program emits.
  Steps queuesAfter(size_t at) const;
  LoopSteps loopAt(size_t at) const;
  void recordStep(size_t at, std::span<const int64_t> stripSizes);
  void recordKernel(const pikoir_cuda_step &step, Steps queues);
  void reset();
  /// What kernels see of the program's pointers.
  void showConstants(GridLaunch &grid) const;
  /// Finds the input and the units of a kernel.
  KernelPlace &join(int32_t number, bool isSource);
  void launch(const pikoir_cuda_grid &grid, KernelPlace &place, int32_t number);
  int64_t blocks(int32_t number, bool isSource, int64_t threads) const;
  /// Sets an image, or a buffer that is sized by a source, to its clear value.
  void clear(int32_t state);
  /// Notes a grid of the runtime's own kernels, for one of the pipeline's.
  void launchOwn(const char *kernel, const void *args, int32_t timed = -1);
  void launchWarp(const char *kernel, const void *args);
  /// As pikort_get_kernel_stats counts them.
  int32_t kernelOf(int32_t number, bool isSource) const;
  int64_t nextNumber() const { return static_cast<int64_t>(steps_.size()); }
  // What kernels of a cycle emit waits in queues (FrameCycles.cpp).
  void queue(const KernelPlace &place, Steps queues);
  void repeat(const int32_t &again);
  void endRepeat(const int32_t &again);
  /// Whether it runs one position at a time.
  bool isStacked(const rt::Stage &stage) const {
    return stage.loop >= 0 && p_.loops[stage.loop].ordered;
  }
  void beginLoop();
  void endLoop();
  void enter();
  void endPosition();
  void endWave();
  void leave();
  void endRounds(int32_t cycle);
  // Strips (FrameStrips.cpp).
  void beginStrips(int32_t group, int64_t size);
  void endStrips(int32_t group);
  StepArgs &takeStep(const std::vector<QueueState *> &waiting);

  void noteStatistics();
  /// Whether the run has changed state that it did not clear.
  bool keepsState() const;

  bool needsHost_ = false; ///< Known from a run before.
  std::vector<Step> steps_;
  std::vector<bool> isCleared_; ///< States of this run.
  Steps program_;
  int32_t timed_ = -1;         ///< The kernel that is recorded.
  StackArgs *stack_ = nullptr; ///< If the loop that is recorded has one.
  int64_t logBegin_ = 0;       ///< Where grids begin to take memory.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_FRAME_H
