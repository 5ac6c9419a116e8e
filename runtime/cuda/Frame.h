// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Frame.h - A pipeline's frame as one submission ---------------------===//
//
// In front of each kernel of the program goes a join (device/Joins.h), which
// finds its input and its units. Grids have as many blocks as fill the device,
// and go over the units that they find. Memory is taken from the pipeline's log
// space, in address order, from the first kernel to the last.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_FRAME_H
#define PIKO_RUNTIME_CUDA_FRAME_H

#include "common/DeviceFrame.h"
#include "common/Pipeline.h"
#include "cuda/device/Joins.h"

#include <map>
#include <string>
#include <vector>

namespace piko::cuda {

class Accelerator;

/// A grid to launch; `arguments` are words of eight bytes.
struct GridLaunch {
  std::string kernel;
  int64_t blocks, threads;
  std::vector<int64_t> arguments;
  bool isJoin; ///< Of the runtime's own kernels; its blocks meet at barriers.
};

class Frame final : public rt::DeviceFrame {
public:
  Frame(pikort_pipeline &p, Accelerator &device) : p_(p), device_(device) {}

  bool begin() override;
  bool isRecording() const override { return isRecording_; }
  const pikoir_input *join(int32_t number, bool isSource) override;
  int64_t blocks(int32_t number, bool isSource, int64_t threads) const override;
  pikoir_log *log(int32_t number, bool isSource) override;
  void clear(int32_t state) override;
  Outcome finish() override;
  void end() noexcept override;

  void launch(GridLaunch grid) { launches_.push_back(std::move(grid)); }

private:
  /// A kernel of the program: a stage's, or the AssignBin of a source.
  struct Place {
    JoinArgs args;
    KernelState state;
  };

  bool isPossible() const;
  void takeMemory();
  size_t placeOf(int32_t number, bool isSource) const;
  Place &find(int32_t number, bool isSource) const {
    return places_[static_cast<int64_t>(placeOf(number, isSource))];
  }
  void describeSource(JoinArgs &args, int32_t source) const;
  void describeStage(JoinArgs &args, const rt::Stage &stage);
  void describeInputs(JoinArgs &args, const rt::Stage &stage) const;
  JoinInput describeSourceInput(const rt::Stage &stage, int32_t source) const;
  JoinInput describeEdge(const rt::Edge &edge) const;
  void describeClears(JoinArgs &args, const rt::Stage &stage);
  /// How many primitives come in, or -1 where only the device knows.
  int64_t mostItems(const JoinArgs &args) const;
  const uint8_t *clearRecord(const rt::State &state);
  void noteStatistics();
  /// Makes the log zero again, as the host's way needs it.
  void clearLog();
  /// Whether the run has changed state that it did not clear.
  bool keepsState() const;

  pikort_pipeline &p_;
  Accelerator &device_;
  bool isRecording_ = false;
  bool needsHost_ = false; ///< Known from a run before.
  std::vector<GridLaunch> launches_;
  std::vector<bool> isCleared_; ///< States of this run.
  const KernelState *last_ = nullptr;
  // From run to run, where the device sees it:
  rt::Array<FrameState> frame_;
  rt::Array<Place> places_;
  rt::Array<uint8_t> clearRecords_;
  std::map<const rt::State *, int64_t> clearOffsets_;
  std::span<uint8_t> used_; ///< Of the log, by the run before.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_FRAME_H
