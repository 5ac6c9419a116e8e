// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaExecutor.cpp - Runs a pipeline on a CUDA device ----------------===//

#include "cuda/CudaExecutor.h"
#include "cpu/loops/Cycle.h"
#include "cpu/loops/Strips.h"
#include "cpu/state/Mirrors.h"

using namespace piko::cuda;
using namespace piko::rt;

/// How many things there are of what a step's number counts.
static size_t countOf(const pikort_pipeline &p, int32_t kind) {
  switch (kind) {
  case PIKOIR_STEP_CLEAR:
    return p.states.size();
  case PIKOIR_STEP_SOURCE:
    return p.sources.size();
  case PIKOIR_STEP_STAGE:
  case PIKOIR_STEP_ENTRY:
  case PIKOIR_STEP_HOST:
    return p.stages.size();
  case PIKOIR_STEP_QUEUE:
  case PIKOIR_STEP_EXIT:
    return p.edges.size();
  case PIKOIR_STEP_STRIPS:
  case PIKOIR_STEP_END_STRIPS:
    return p.stripGroups.size();
  case PIKOIR_STEP_WAVES:
  case PIKOIR_STEP_END_WAVES:
    return p.loops.size();
  case PIKOIR_STEP_ROUNDS:
  case PIKOIR_STEP_END_ROUNDS:
    return p.cycles.size();
  default:
    return 0;
  }
}

/// The steps that begin and end what is repeated.
static constexpr int32_t repeated[][2] = {
    {PIKOIR_STEP_STRIPS, PIKOIR_STEP_END_STRIPS},
    {PIKOIR_STEP_WAVES, PIKOIR_STEP_END_WAVES},
    {PIKOIR_STEP_ROUNDS, PIKOIR_STEP_END_ROUNDS}};

/// Throws Failure unless all that is repeated ends, in the order of nesting,
/// and numbers are of what has been declared.
static void check(const pikort_pipeline &p, Steps program) {
  std::vector<const pikoir_cuda_step *> open;
  auto isWrong = [&](const pikoir_cuda_step &step) {
    bool hasGrids =
        step.kind == PIKOIR_STEP_STAGE || step.kind == PIKOIR_STEP_SOURCE;
    if (static_cast<size_t>(step.number) >= countOf(p, step.kind) ||
        hasGrids != (step.grids != nullptr) ||
        (step.kind == PIKOIR_STEP_HOST) != (step.host != nullptr))
      return true;
    for (auto [begin, end] : repeated) {
      if (step.kind == begin)
        open.push_back(&step);
      if (step.kind != end)
        continue;
      if (open.empty() || open.back()->kind != begin ||
          open.back()->number != step.number)
        return true;
      open.pop_back();
    }
    return false;
  };
  for (const pikoir_cuda_step &step : program)
    if (isWrong(step))
      throw Failure{PIKORT_BAD_PROGRAM,
                    "pipeline " + quoted(p.name) + ": did not expect step " +
                        std::to_string(&step - program.data()) +
                        " of its program, of kind " +
                        std::to_string(step.kind) + " and number " +
                        std::to_string(step.number)};
  if (!open.empty())
    throw Failure{PIKORT_BAD_PROGRAM,
                  "pipeline " + quoted(p.name) +
                      ": expected an end of what step " +
                      std::to_string(open.back() - program.data()) +
                      " of its program begins"};
}

void CudaExecutor::prepare() {
  check(p, program_);
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
