// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaExecutor.h - Runs a pipeline on a CUDA device ------------------===//
//
// A device takes a run as a whole where the program says what to do as a table
// of steps, and nothing needs the host meanwhile (DeviceFrame). Else, or where
// that ends early, the run goes through the program on the host, which joins
// what kernels emit, as for a CPU; the device runs the kernels.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_CUDAEXECUTOR_H
#define PIKO_RUNTIME_CUDA_CUDAEXECUTOR_H

#include "cpu/CPUExecutor.h"
#include "cuda/frame/Frame.h"

namespace piko::cuda {

class CudaExecutor final : public rt::CPUExecutor {
public:
  CudaExecutor(pikort_pipeline &p, Accelerator &device);

  /// In the setup: what the program does.
  void setProgram(Steps program) { program_ = program; }

  void prepare() override;
  void beginRun() override;
  int32_t runProgram() override;
  bool isPending() const override { return isPending_; }
  bool isDone() const override { return frame_.isDone(); }
  int32_t awaitProgram() override;
  bool wasRepeated() const override { return isRepeated_; }
  void endRun() override;

private:
  void showState() override;
  void takeState() override;
  void showSerial(rt::Kernel &kernel, const rt::Items &from) override;
  const pikoir_input *show(rt::Kernel &kernel) override;
  /// Whether the device takes the run as a whole, as far as is known.
  bool takesWhole() const { return !program_.empty() && frame_.isPossible(); }
  void record();
  /// Runs the program step by step, for a frame that could not.
  int32_t repeatProgram(DeviceFrame::Outcome outcome);
  /// Begins the run anew, on what it began with.
  void restartRun();

  DeviceFrame frame_;
  Steps program_;
  bool isPending_ = false;  ///< The run has been submitted.
  bool isRepeated_ = false; ///< It had to be, after it.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_CUDAEXECUTOR_H
