// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- FrameDescription.h - What the device is told of a frame ------------===//

#ifndef PIKO_RUNTIME_CUDA_FRAMEDESCRIPTION_H
#define PIKO_RUNTIME_CUDA_FRAMEDESCRIPTION_H

#include "common/Pipeline.h"
#include "cuda/Exchange.h"
#include "cuda/device/Joins.h"
#include "pikort/grid.h"

#include <map>
#include <span>
#include <vector>

namespace piko::cuda {

class Accelerator;

/// Steps of a program, one after the other.
using Steps = std::span<const pikoir_cuda_step>;

/// What kernels, queues, loops, cycles and strips have on the device, and what
/// the runtime's own kernels are told of them. It launches nothing.
class FrameDescription {
protected:
  FrameDescription(pikort_pipeline &p, Accelerator &device);

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

  void takeMemory();
  /// Where the device has what the host has.
  template <class T> T *onDevice(T *data) const {
    return exchange_.onDevice(data);
  }
  KernelPlace &find(int32_t number, bool isSource) const {
    return places_[placeOf(number, isSource)];
  }
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
  /// What comes into the loop at a stage.
  QueueState &entriesOf(int32_t stage) const {
    return queues_[p_.edges.size() + static_cast<size_t>(stage)];
  }

  JoinArgs &describeSource(int32_t source);
  JoinArgs &describeStage(int32_t number);
  std::vector<JoinInput> describeInputs(const rt::Stage &stage) const;
  Shape describeShape(const rt::Stage &stage) const;
  /// Where the device has the record that an image is cleared to.
  const uint8_t *clearRecord(const rt::State &state);
  /// How many primitives come in, or -1 where only the device knows.
  int64_t mostItems(const JoinArgs &args) const;
  std::vector<QueuePort> describePorts(Steps queues) const;
  StackArgs &describeStack();
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

  pikort_pipeline &p_;
  Accelerator &device_;
  LoopSteps loop_; ///< The loop that is recorded.
  /// Of each stage whose schedule depends on the bin.
  std::map<const rt::Stage *, const BinCut *> cuts_;
  std::map<const rt::State *, const uint8_t *> clearRecords_;
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
  rt::DeviceBytes blockSums_;         ///< The device's alone.

private:
  size_t placeOf(int32_t number, bool isSource) const;
  std::vector<JoinInput> describeWave(int32_t number) const;
  void describeSchedule(JoinArgs &args, const rt::Stage &stage);
  const BinCut *describeBins(const rt::Stage &stage);
  JoinInput describeSourceInput(const rt::Stage &stage, int32_t source) const;
  JoinInput describeEdge(int32_t number) const;
  std::vector<JoinClear> describeClears(const rt::Stage &stage);
  /// Where the loop that is being recorded is entered; null elsewhere.
  const pikoir_cuda_step *entryOf(int32_t stage) const;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_FRAMEDESCRIPTION_H
