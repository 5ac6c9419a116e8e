// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Run.cpp - Begins and ends kernels ----------------------------------===//

#include "cpu/Check.h"
#include "cpu/Cycle.h"
#include "cpu/Strips.h"

#include <algorithm>

using namespace piko::rt;

static double millisecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(
             std::chrono::steady_clock::now() - start)
      .count();
}

void Kernel::clear() {
  stream = {};
  input = {};
  offsets = {};
  order = {};
  calls = {};
  rank = {};
  rankSize = 0;
  positions = 0;
  keys = {};
  counts.clear();
  units.clear();
  for (auto &lane : lanes)
    lane->clear();
  firstRound = true;
  launch = 0;
  pendingOutputs = 0;
  open = false;
}

void piko::rt::makeKernels(pikort_pipeline &p) {
  auto make = [&](int32_t stage, int32_t source) {
    auto kernel = std::make_shared<Kernel>();
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
  for (int32_t s : p.order) {
    Stage &stage = p.stages[s];
    for (int32_t source : stage.sources)
      if (stage.placed())
        p.sources[source].kernel = make(s, source);
    stage.kernel = make(s, -1);
  }
}

/// What generated code sees of a kernel that is ready to run.
static void publish(const pikort_pipeline &p, Kernel &kernel) {
  const Stage &stage = p.stages[kernel.stage];
  kernel.input = {kernel.stream.items,
                  kernel.positions,
                  kernel.order.data(),
                  kernel.offsets.data(),
                  kernel.units.data(),
                  static_cast<int64_t>(kernel.units.size()),
                  kernel.source >= 0 ? 1 : stage.tiles,
                  kernel.calls.data(),
                  kernel.calls.size()};
}

/// Units for the AssignBin of a source: any chunks will do.
static void prepareSource(pikort_pipeline &p, Kernel &kernel) {
  const Source &source = p.sources[kernel.source];
  kernel.stream.items =
      source.data +
      source.begin * p.records[p.stages[kernel.stage].record].size;
  kernel.stream.count = source.end - source.begin;
  Stage whole;
  whole.flags = PIKOIR_SPLIT;
  binItems(p, whole, kernel, false);
  cutUnits(p, whole, kernel);
  kernel.pendingOutputs = 1;
}

void piko::rt::prepareOutputs(pikort_pipeline &p, const Stage &stage,
                              Kernel &kernel) {
  kernel.pendingOutputs = 0;
  kernel.counts.resize(stage.outputs.size());
  for (size_t port = 0; port < stage.outputs.size(); ++port) {
    int32_t e = stage.outputs[port];
    if (e < 0 || p.edges[e].local)
      continue;
    ++kernel.pendingOutputs;
    if (byPosition(p, p.edges[e]))
      kernel.counts[port] = Array<uint32_t>(p.memory, kernel.slots());
  }
}

static void prepareStage(pikort_pipeline &p, Kernel &kernel) {
  Stage &stage = p.stages[kernel.stage];
  Cycle *cycle = p.cycleOf(stage);
  kernel.stream =
      cycle ? cycle->takeInput(kernel) : gatherInputs(p, stage, true);
  if (stage.keyWidth > 0)
    kernel.keys = std::move(kernel.stream.keys);
  if (Strips *strips = p.stripsOf(stage); strips && stage.collects())
    kernel.launch = strips->number();
  bool rankNeeded = stage.loop >= 0;
  for (int32_t e : stage.outputs)
    if (e >= 0 && !p.edges[e].local)
      rankNeeded |=
          p.edges[e].keyed ||
          !(stage.unordered() || p.stages[p.edges[e].consumer].unordered());
  binItems(p, stage, kernel, rankNeeded);
  cutUnits(p, stage, kernel);
  prepareOutputs(p, stage, kernel);
  StageStats &stats = p.stageStats[kernel.stage];
  stats.in += kernel.stream.count;
  stats.placed += kernel.positions;
}

static const pikoir_input *begin(pikort_pipeline &p, Kernel &kernel) {
  if (p.status != PIKORT_OK)
    return nullptr;
  int32_t code =
      guarded(&p, "stage " + quoted(p.stages[kernel.stage].name), [&] {
        kernel.clear();
        kernel.started = std::chrono::steady_clock::now();
        if (kernel.source >= 0)
          prepareSource(p, kernel);
        else
          prepareStage(p, kernel);
        prepareLanes(p, kernel);
        beginLocals(p, kernel);
        publish(p, kernel);
        kernel.open = true;
        Strips *strips = p.stripsOf(p.stages[kernel.stage]);
        if (strips && kernel.source < 0 && p.stages[kernel.stage].writes())
          strips->commit();
        p.activeThreads = static_cast<int32_t>(
            std::clamp<int64_t>(kernel.input.unit_count, 1, p.threads));
      });
  KernelStats &stats = p.kernelStats[kernel.statsIndex];
  stats.joinMilliseconds += millisecondsSince(kernel.started);
  return code == PIKORT_OK ? &kernel.input : nullptr;
}

static int32_t end(pikort_pipeline &p, Kernel &kernel) {
  int32_t status = p.settle();
  if (!kernel.open)
    return status;
  if (kernel.source < 0)
    for (auto &lane : kernel.lanes)
      p.stageStats[kernel.stage].out += lane->emitted;
  endLocals(p, kernel, status);
  p.activeThreads = p.threads;
  kernel.open = false;
  kernel.stream = {};
  kernel.input = {};
  if (kernel.pendingOutputs == 0 || status != PIKORT_OK)
    kernel.clear();
  KernelStats &stats = p.kernelStats[kernel.statsIndex];
  stats.milliseconds += millisecondsSince(kernel.started);
  ++stats.launches;
  Cycle *cycle = p.cycleOf(p.stages[kernel.stage]);
  if (kernel.source >= 0 || status != PIKORT_OK)
    return status;
  if (Strips *strips = p.stripsOf(p.stages[kernel.stage]); strips && !cycle)
    strips->absorb(kernel);
  if (!cycle)
    return p.status.load();
  return guarded(&p, "stage " + quoted(p.stages[kernel.stage].name),
                 [&] { cycle->absorb(kernel); });
}

/// The kernel of a stage or a source, or null and an error.
static Kernel *find(pikort_pipeline *p, const auto &list, int32_t index,
                    const char *what) noexcept {
  if (index >= 0 && index < static_cast<int32_t>(list.size()) &&
      list[index].kernel)
    return list[index].kernel.get();
  guarded(p, "run", [&] {
    throw Failure{PIKORT_BAD_PROGRAM, std::string("expected the number of a ") +
                                          what + ", but got " +
                                          std::to_string(index)};
  });
  return nullptr;
}

extern "C" {

const pikoir_input *pikoir_begin(pikort_pipeline *p, int32_t stage) {
  Kernel *kernel = find(p, p->stages, stage, "stage");
  if (kernel && p->checker)
    p->checker->beginStage(stage);
  return kernel ? begin(*p, *kernel) : nullptr;
}

int32_t pikoir_end(pikort_pipeline *p, int32_t stage) {
  Kernel *kernel = find(p, p->stages, stage, "stage");
  if (p->checker)
    p->checker->endStage();
  return kernel ? end(*p, *kernel) : p->status.load();
}

const pikoir_input *pikoir_begin_source(pikort_pipeline *p, int32_t source) {
  Kernel *kernel = find(p, p->sources, source, "placed source");
  return kernel ? begin(*p, *kernel) : nullptr;
}

int32_t pikoir_end_source(pikort_pipeline *p, int32_t source) {
  Kernel *kernel = find(p, p->sources, source, "placed source");
  return kernel ? end(*p, *kernel) : p->status.load();
}

void pikoir_fail(pikort_pipeline *p, int32_t stage, const char *name,
                 int64_t bin, int32_t code, int64_t a, int64_t b) {
  const Stage *found = p->findStage(stage);
  p->report({INT64_MAX, code == PIKORT_OK ? PIKORT_BAD_PROGRAM : code, stage, a,
             b, found ? found->depth : 0, bin, name ? name : ""});
}

const void *pikoir_get_source(pikort_pipeline *p, int32_t source,
                              int64_t *count) {
  bool exists = source >= 0 && source < static_cast<int32_t>(p->sources.size());
  *count = exists ? p->sources[source].count : 0;
  return exists ? p->sources[source].data : nullptr;
}

int32_t pikoir_fail_text(pikort_pipeline *p, int32_t code, const char *text) {
  return guarded(p, "run", [&] {
    throw Failure{code == PIKORT_OK ? PIKORT_BAD_PROGRAM : code,
                  "pipeline " + quoted(p->name) + ": " + text};
  });
}

int32_t pikoir_status(pikort_pipeline *p) {
  int32_t status = p->status.load();
  return status ? status : p->reported.load();
}

} // extern "C"
