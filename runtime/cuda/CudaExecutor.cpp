// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaExecutor.cpp - Runs a pipeline on a CUDA device ----------------===//

#include "cuda/CudaExecutor.h"
#include "cpu/loops/Cycle.h"
#include "cpu/loops/Strips.h"
#include "cuda/Accelerator.h"
#include "cuda/frame/ProgramCheck.h"
#include "gpu/Mirrors.h"

using namespace piko::cuda;
using namespace piko::rt;

CudaExecutor::CudaExecutor(pikort_pipeline &p, Accelerator &device)
    : CPUExecutor(p), frame_(p, device) {
  blocksAtOnce = device.residentThreads() / 64;
}

void CudaExecutor::showState() { beginMirrors(p, takesWhole()); }

void CudaExecutor::takeState() { endMirrors(p); }

void CudaExecutor::showSerial(Kernel &kernel, const Items &from) {
  shareInput(p, kernel, from);
}

const pikoir_input *CudaExecutor::show(Kernel &kernel) {
  return shareKernel(p, kernel);
}

void CudaExecutor::prepare() {
  checkProgram(p, program_);
  CPUExecutor::prepare();
}

void CudaExecutor::beginRun() {
  isRepeated_ = false;
  CPUExecutor::beginRun();
}

void CudaExecutor::record() {
  std::vector<int64_t> stripSizes;
  for (const std::unique_ptr<Strips> &group : strips)
    stripSizes.push_back(group->size());
  for (const pikoir_cuda_step &step : program_)
    if (step.kind == PIKOIR_STEP_STAGE)
      cleared[static_cast<size_t>(step.number)] = true;
  frame_.record(program_, stripSizes);
}

int32_t CudaExecutor::runProgram() {
  if (!takesWhole())
    return CPUExecutor::runProgram();
  guarded(&p, "run", [&] {
    record();
    if (p.settle() == PIKORT_OK)
      isPending_ = frame_.submit();
  });
  return isPending_ || p.status != PIKORT_OK
             ? p.status.load()
             : repeatProgram(DeviceFrame::Outcome::Repeat);
}

int32_t CudaExecutor::awaitProgram() {
  isPending_ = false;
  p.profile.enter(Part::Device);
  DeviceFrame::Outcome outcome = frame_.await();
  p.profile.enter(Part::Program);
  if (outcome == DeviceFrame::Outcome::Done)
    return p.status;
  isRepeated_ = true;
  return repeatProgram(outcome);
}

int32_t CudaExecutor::repeatProgram(DeviceFrame::Outcome outcome) {
  restartRun();
  int32_t status = CPUExecutor::runProgram();
  if (status == PIKORT_OK && p.settle() == PIKORT_OK &&
      outcome == DeviceFrame::Outcome::Spoilt)
    throw Failure{PIKORT_OUT_OF_MEMORY,
                  "pipeline " + quoted(p.name) +
                      ": out of memory on the device, and what the run changes "
                      "in place is lost"};
  return status;
}

void CudaExecutor::restartRun() {
  clearKernels();
  endStrips(p);
  endCycles(p);
  cleared.assign(p.stages.size(), false);
  p.accelerator->finishStream();
  refillMirrors(p);
  startCycles(p);
  startStrips(p);
}

void CudaExecutor::endRun() {
  isPending_ = false;
  p.accelerator->endStream();
  CPUExecutor::endRun();
}
