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

#include "common/Pipeline.h"
#include "cuda/Exchange.h"
#include "cuda/device/Joins.h"
#include "pikort/grid.h"

#include <map>
#include <span>
#include <string>
#include <vector>

namespace piko::cuda {

class Accelerator;

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

/// Steps of a program, one after the other.
using Steps = std::span<const pikoir_cuda_step>;

class DeviceFrame {
public:
  DeviceFrame(pikort_pipeline &p, Accelerator &device);

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
  /// A kernel of the program: a stage's, or the AssignBin of a source.
  struct KernelPlace {
    KernelState state;
    JoinArgs *args; ///< Of its latest join, where the host has them.
    int32_t stage;  ///< -1: of a source.
  };
  /// A loop of the program, with what stands in the table of it.
  struct LoopSteps {
    int32_t number = -1;
    std::vector<const pikoir_cuda_step *> entries, exits;
    struct Member {
      int32_t stage;
      Steps queues;
    };
    std::vector<Member> members;
  };
  /// Strips of a source while a frame is recorded.
  struct StripRecord {
    StripState *state = nullptr; ///< Null before they begin.
    bool isDivided = false;
  };

  /// The queues of what the kernel at a place of the program emits.
  Steps queuesAfter(size_t at) const;
  LoopSteps loopAt(size_t at) const;
  void recordStep(size_t at, std::span<const int64_t> stripSizes);
  void recordKernel(const pikoir_cuda_step &step, Steps queues);
  /// Whether the producer's kernel may run several times before the consumer's.
  bool hasQueue(const rt::Edge &edge) const {
    const rt::Stage &from = p_.stages[edge.producer];
    return from.cycle >= 0 ||
           (edge.leavesStrips &&
            strips_[static_cast<size_t>(from.stripGroup)].isDivided);
  }
  /// Of the source that a stage takes strip by strip, or null.
  const StripState *stripOf(const rt::Stage &stage) const {
    return stage.stripGroup < 0
               ? nullptr
               : strips_[static_cast<size_t>(stage.stripGroup)].state;
  }
  void reset();
  void takeMemory();
  /// Where the device has what the host has.
  template <class T> T *onDevice(T *data) const {
    return exchange_.onDevice(data);
  }
  /// What kernels see of the program's pointers.
  void showConstants(GridLaunch &grid) const;
  /// Finds the input and the units of a kernel.
  KernelPlace &join(int32_t number, bool isSource);
  void launch(const pikoir_cuda_grid &grid, KernelPlace &place, int32_t number);
  int64_t blocks(int32_t number, bool isSource, int64_t threads) const;
  /// Sets an image, or a buffer that is sized by a source, to its clear value.
  void clear(int32_t state);
  size_t placeOf(int32_t number, bool isSource) const;
  KernelPlace &find(int32_t number, bool isSource) const {
    return places_[placeOf(number, isSource)];
  }
  /// Notes a grid of the runtime's own kernels, for one of the pipeline's.
  void launchOwn(const char *kernel, const void *args, int32_t timed = -1);
  void launchWarp(const char *kernel, const void *args);
  /// As pikort_get_kernel_stats counts them.
  int32_t kernelOf(int32_t number, bool isSource) const;
  int64_t nextNumber() const { return static_cast<int64_t>(steps_.size()); }
  JoinArgs &describeSource(int32_t source);
  JoinArgs &describeStage(int32_t number);
  std::vector<JoinInput> describeInputs(const rt::Stage &stage) const;
  std::vector<JoinInput> describeWave(int32_t number) const;
  void describeSchedule(JoinArgs &args, const rt::Stage &stage);
  const BinCut *describeBins(const rt::Stage &stage);
  JoinInput describeSourceInput(const rt::Stage &stage, int32_t source) const;
  JoinInput describeEdge(int32_t number) const;
  Shape describeShape(const rt::Stage &stage) const;
  std::vector<JoinClear> describeClears(const rt::Stage &stage);
  /// How many primitives come in, or -1 where only the device knows.
  int64_t mostItems(const JoinArgs &args) const;
  /// Where the device has the record that an image is cleared to.
  const uint8_t *clearRecord(const rt::State &state);
  // What kernels of a cycle emit waits in queues (FrameCycles.cpp).
  void queue(const KernelPlace &place, Steps queues);
  void repeat(const int32_t &again);
  void endRepeat(const int32_t &again);
  QueueState &entriesOf(int32_t stage) const {
    return queues_[p_.edges.size() + static_cast<size_t>(stage)];
  }
  /// Whether it runs one position at a time.
  bool isStacked(const rt::Stage &stage) const {
    return stage.loop >= 0 && p_.loops[stage.loop].ordered;
  }
  /// Where the loop that is being recorded is entered; null elsewhere.
  const pikoir_cuda_step *entryOf(int32_t stage) const;
  std::vector<QueuePort> describePorts(Steps queues) const;
  StackArgs &describeStack();
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
  std::vector<StripQueue> describeLeaving(int32_t group) const;
  std::vector<QueueState *> describeInside(int32_t group) const;
  /// The queues of edges that are wanted.
  template <class Wanted>
  std::vector<QueueState *> describeWaiting(const Wanted &wanted) const {
    std::vector<QueueState *> queues;
    for (size_t e = 0; e < p_.edges.size(); ++e)
      if (wanted(p_.edges[e]))
        queues.push_back(onDevice(&queues_[e]));
    return queues;
  }
  StepArgs &takeStep(const std::vector<QueueState *> &waiting);

  void noteStatistics();
  /// Whether the run has changed state that it did not clear.
  bool keepsState() const;

  pikort_pipeline &p_;
  Accelerator &device_;
  bool needsHost_ = false; ///< Known from a run before.
  std::vector<Step> steps_;
  std::vector<bool> isCleared_; ///< States of this run.
  Steps program_;
  int32_t timed_ = -1;         ///< The kernel that is recorded.
  LoopSteps loop_;             ///< The loop that is.
  StackArgs *stack_ = nullptr; ///< If that has one.
  /// Of each stage whose schedule depends on the bin.
  std::map<const rt::Stage *, const BinCut *> cuts_;
  std::vector<StripRecord> strips_; ///< Of each group.
  // What host and device have of a frame:
  Exchange exchange_;
  KernelPlace *places_ = nullptr;
  uint64_t *received_ = nullptr; ///< Of each edge, then of each source.
  FrameState *frame_ = nullptr;  ///< To here the device says something.
  /// Of each edge, then, of what comes into a loop, of each stage.
  QueueState *queues_ = nullptr;
  LoopState *loops_ = nullptr;
  CycleState *cycles_ = nullptr;
  StackState *stackStates_ = nullptr; ///< Of each loop.
  std::map<const rt::State *, const uint8_t *> clearRecords_;
  rt::DeviceBytes blockSums_; ///< The device's alone.
  int64_t logBegin_ = 0;      ///< Where grids begin to take memory.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_FRAME_H
