// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CPUExecutor.cpp - Begins and ends runs -----------------------------===//

#include "cpu/CPUExecutor.h"
#include "cpu/Check.h"
#include "cpu/Cycle.h"
#include "cpu/Mirrors.h"
#include "cpu/Strips.h"

#include <algorithm>
#include <omp.h>

using namespace piko::rt;

std::unique_ptr<Executor> piko::rt::makeExecutor(pikort_pipeline &p) {
  return std::make_unique<CPUExecutor>(p);
}

CPUExecutor::CPUExecutor(pikort_pipeline &p) : p(p) {}
CPUExecutor::~CPUExecutor() = default;

int32_t CPUExecutor::defaultThreads() const {
  return std::max(1, omp_get_max_threads());
}

void CPUExecutor::prepare() {
  if (p.accelerator)
    frame = p.accelerator->makeFrame();
  auto make = [&](int32_t stage, int32_t source) {
    auto kernel = std::make_unique<Kernel>();
    kernel->stage = stage;
    kernel->source = source;
    kernel->statsIndex = p.kernelStats.size();
    KernelStats stats;
    stats.name = p.stages[stage].name;
    if (source >= 0)
      stats.name += ".assign" + std::to_string(source);
    p.kernelStats.push_back(std::move(stats));
    return kernel;
  };
  sourceKernels.resize(p.sources.size());
  for (size_t s = 0; s < p.stages.size(); ++s) {
    const Stage &stage = p.stages[s];
    for (int32_t source : stage.sources)
      if (stage.placed())
        sourceKernels[source] = make(static_cast<int32_t>(s), source);
    kernels.push_back(make(static_cast<int32_t>(s), -1));
  }
}

void CPUExecutor::beginRun() {
  prepareState(p);
  beginMirrors(p);
  startCounters(p);
  p.profile.enter(Part::Program);
  if (checker)
    checker->beginRun();
  if (p.status != PIKORT_OK)
    return;
  activeThreads = p.threads;
  startCycles(p);
  startStrips(p);
}

int32_t CPUExecutor::runProgram() {
  if (!frame || !frame->begin())
    return p.runProgram(&p);
  using Outcome = DeviceFrame::Outcome;
  Outcome outcome = Outcome::Done;
  guarded(&p, "run", [&] {
    int32_t status = p.runProgram(&p);
    if (status == PIKORT_OK && p.settle() == PIKORT_OK)
      outcome = frame->finish();
  });
  frame->end();
  if (outcome == Outcome::Done || p.status != PIKORT_OK)
    return p.status;
  restartRun();
  int32_t status = p.runProgram(&p);
  if (status == PIKORT_OK && p.settle() == PIKORT_OK &&
      outcome == Outcome::Spoilt)
    throw Failure{PIKORT_OUT_OF_MEMORY,
                  "pipeline " + quoted(p.name) +
                      ": out of memory on the device, and what it kept from "
                      "the run before is lost"};
  return status;
}

void CPUExecutor::restartRun() {
  for (auto *list : {&kernels, &sourceKernels})
    for (std::unique_ptr<Kernel> &kernel : *list)
      if (kernel)
        kernel->clear();
  endStrips(p);
  endCycles(p);
  cleared.assign(p.stages.size(), false);
  refillMirrors(p);
  startCycles(p);
  startStrips(p);
}

void CPUExecutor::endRun() {
  endClears(p);
  endMirrors(p);
  endStrips(p);
  endCycles(p);
  if (checker)
    checker->endRun();
  for (auto *list : {&kernels, &sourceKernels})
    for (std::unique_ptr<Kernel> &kernel : *list)
      if (kernel)
        kernel->clear();
}

void CPUExecutor::noteError() {
  if (checker)
    checker->noteError();
}

std::string CPUExecutor::describe(int32_t code,
                                  const std::string &plain) const {
  return checker ? checker->describe(code, plain) : plain;
}
