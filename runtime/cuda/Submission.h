// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Submission.h - Steps of a frame on a device ------------------------===//
//
// Several steps are one graph, where the driver has what that takes; what they
// repeat is a conditional node, whose condition a kernel sets. Older drivers
// get the grids one by one, and the host reads whether it goes on.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_SUBMISSION_H
#define PIKO_RUNTIME_CUDA_SUBMISSION_H

#include "cuda/Device.h"
#include "cuda/KernelTimes.h"
#include "cuda/frame/Frame.h"

namespace piko::cuda {

/// Sets the condition of a graph's node (device/Condition.cpp).
inline constexpr const char *conditionKernel = "piko_condition";

class Submission {
public:
  Submission(Accelerator &accelerator, const Device &device)
      : accelerator_(accelerator), times_(device) {}
  Submission(const Submission &) = delete;
  Submission &operator=(const Submission &) = delete;

  /// Gives the stream of the run what the steps say. The device must be
  /// entered; throws.
  void run(std::span<const Step> steps);
  /// When that has ended: adds what kernels took, if that is measured; throws.
  void addTimes();
  /// Frees what it has of the device, which must be entered.
  void end() noexcept;

private:
  const Driver &driver() const;
  void check(CUresult result);
  bool canBeGraph(std::span<const Step> steps) const;
  /// Makes `graph_` of the steps, and launches it; false if they are to run one
  /// by one, also because the driver refuses conditions, as where MPS shares
  /// the device.
  bool tryGraph(std::span<const Step> steps);
  void runOneByOne(std::span<const Step> steps);
  /// What stands between a Repeat, the first step, and its end.
  static std::span<const Step> bodyOf(std::span<const Step> steps);

  /// Makes `graph_` of the steps, or changes it to them.
  void makeGraph(std::span<const Step> steps);
  CUgraph capture(std::span<const Step> steps);
  CUresult endCapture(CUstream stream, CUgraph &graph) const;
  /// On a stream that is captured; bodies are captured on others.
  void addSteps(std::span<const Step> steps, size_t depth);
  void addRepeat(std::span<const Step> body, const int32_t *again,
                 size_t depth);
  void setCondition(CUgraphConditionalHandle handle, const int32_t *again,
                    size_t depth);
  /// The pipeline's own, or one for bodies in bodies.
  CUstream streamOf(size_t depth);
  void dropGraph() noexcept;
  void beginTimes();

  Accelerator &accelerator_;
  KernelTimes times_;
  bool timesKernels_ = false; ///< Of the run.
  std::vector<CUstream> bodyStreams_;
  size_t captured_ = 0; ///< Streams of bodies that are captured.
  CUgraphExec graph_ = nullptr;
  bool refusesConditions_ = false;
  std::vector<Step> steps_; ///< Of the graph.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_SUBMISSION_H
