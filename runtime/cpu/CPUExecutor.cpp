// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CPUExecutor.cpp - Begins and ends runs -----------------------------===//

#include "cpu/CPUExecutor.h"
#include "cpu/check/Check.h"
#include "cpu/loops/Cycle.h"
#include "cpu/loops/Strips.h"
#include "ranks/Ranks.h"

#include <algorithm>

using namespace piko::rt;

std::unique_ptr<Executor> piko::rt::makeExecutor(pikort_pipeline &p) {
  return std::make_unique<CPUExecutor>(p);
}

CPUExecutor::CPUExecutor(pikort_pipeline &p) : p(p) {}
CPUExecutor::~CPUExecutor() = default;

void CPUExecutor::prepare() {
  auto make = [&](int32_t stage, int32_t source) {
    auto kernel = std::make_unique<Kernel>();
    kernel->stage = stage;
    kernel->source = source;
    kernel->statsIndex = p.kernelStats.size();
    KernelStats stats;
    stats.name = p.stages[stage].name;
    if (source >= 0)
      stats.name += ".assign" + std::to_string(source);
    std::vector<Mapping> &all = p.mappings;
    auto isOwn = [&](const Mapping &mapping) {
      return mapping.stage == stage && mapping.source == source;
    };
    auto first = std::find_if(all.begin(), all.end(), isOwn),
         last = std::find_if_not(first, all.end(), isOwn);
    for (Mapping &mapping : std::span(first, last))
      mapping.kernel = kernel->statsIndex;
    if (first != last)
      kernel->tuner = std::make_unique<Autotuner>(std::span(first, last));
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
  for (const Mapping &mapping : p.mappings)
    if (!p.findStage(mapping.stage) ||
        mapping.source >= static_cast<int32_t>(p.sources.size()) ||
        (mapping.source >= 0 && !sourceKernels[mapping.source]))
      throw Failure{PIKORT_BAD_PROGRAM,
                    "expected a mapping of a kernel's loop, but got one of "
                    "stage " +
                        std::to_string(mapping.stage) + ", source " +
                        std::to_string(mapping.source)};
}

void CPUExecutor::beginRun() {
  prepareState(p);
  showState();
  startCounters(p);
  p.profile.enter(Part::Program);
  if (checker)
    checker->beginRun();
  if (p.status != PIKORT_OK)
    return;
  activeThreads = p.threads;
  startCycles(p);
  startStrips(p);
  if (!p.ranks)
    return;
  p.ranks->beginRun();
  for (size_t e = 0; e < p.edges.size(); ++e)
    if (p.edges[e].exchanged && !queues[e])
      queues[e] = std::make_unique<Queue>();
}

const pikoir_input *CPUExecutor::show(Kernel &kernel) { return &kernel.input; }

int32_t CPUExecutor::runProgram() { return p.runProgram(&p); }

void CPUExecutor::clearKernels() {
  for (auto *list : {&kernels, &sourceKernels})
    for (std::unique_ptr<Kernel> &kernel : *list)
      if (kernel)
        kernel->clear();
}

void CPUExecutor::endRun() {
  endClears(p);
  takeState();
  endStrips(p);
  endCycles(p);
  if (checker)
    checker->endRun();
  clearKernels();
}

void CPUExecutor::noteError() {
  if (checker)
    checker->noteError();
}

/// The first bin of the unit, or of a stage that is divided by primitives the
/// rank and the unit.
int64_t CPUExecutor::placeOf(const KernelError &error) const {
  const Stage *stage = p.findStage(error.stage);
  if (error.unit == INT64_MAX || !stage)
    return error.unit;
  const Kernel &kernel = *kernels[static_cast<size_t>(
      stage->host < 0 ? error.stage : stage->host)];
  auto unit = static_cast<size_t>(error.unit);
  if (stage->partition != PIKOIR_BINS || unit >= kernel.units.size())
    return (int64_t(p.ranks->rank()) << 40) + error.unit;
  int64_t first = kernel.units[unit].bucket_begin;
  return kernel.calls ? kernel.calls[first].bin * stage->tiles : first;
}

std::string CPUExecutor::describe(int32_t code,
                                  const std::string &plain) const {
  return checker ? checker->describe(code, plain) : plain;
}
