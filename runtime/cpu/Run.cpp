// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Run.cpp - Begins and ends kernels ----------------------------------===//

#include "cpu/check/Check.h"
#include "cpu/loops/Cycle.h"
#include "cpu/loops/Strips.h"
#include "cpu/state/PrivateCopies.h"
#include "cpu/state/PrivateImages.h"
#include "ranks/Ranks.h"

#include <algorithm>

using namespace piko::rt;

Kernel::Kernel() = default;
Kernel::~Kernel() = default;

void Kernel::clear() {
  stream = {};
  input = {};
  offsets = {};
  order = {};
  places = {};
  calls = {};
  rank = {};
  rankSize = 0;
  positions = 0;
  keys = {};
  slotNames = {};
  counts.clear();
  units.clear();
  if (mirror)
    mirror->clear();
  for (auto &lane : lanes)
    lane->clear();
  firstRound = true;
  launch = 0;
  serial.reset();
  runsSerially = false;
  pendingOutputs = 0;
  open = false;
}

/// What generated code sees of a kernel that is ready to run.
static void publish(pikort_pipeline &p, Kernel &kernel) {
  const Stage &stage = p.stages[kernel.stage];
  const uint32_t *order = kernel.places  ? kernel.places.data()
                          : kernel.order ? kernel.order.data()
                                         : kernel.stream.index;
  kernel.input = {kernel.stream.items,
                  kernel.positions,
                  order,
                  kernel.offsets.data(),
                  kernel.units.data(),
                  static_cast<int64_t>(kernel.units.size()),
                  kernel.source >= 0 ? 1 : stage.tiles,
                  kernel.calls.data(),
                  kernel.calls.size(),
                  /*clears=*/0,
                  /*cursors=*/nullptr,
                  /*homes=*/0};
}

static void openLanes(pikort_pipeline &p, Kernel &kernel) {
  prepareLanes(p, kernel);
  beginLocals(p, kernel);
  publish(p, kernel);
}

/// Units for the AssignBin of a source: any chunks will do.
[[gnu::noinline]] static void prepareSource(pikort_pipeline &p,
                                            Kernel &kernel) {
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
  openLanes(p, kernel);
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
    if (needsCounts(p, p.edges[e]))
      kernel.counts[port] = Array<uint32_t>(p.memory, kernel.slots());
  }
}

/// Decides how a kernel is launched, and drops what no launch needs.
static void chooseLaunch(pikort_pipeline &p, Kernel &kernel) {
  Cycle *cycle =
      kernel.source < 0 ? cycleOf(p, p.stages[kernel.stage]) : nullptr;
  bool serially = cycle && cycle->runsSerially(kernel);
  if (!serially || !kernel.serial)
    kernel.clear();
  if (serially && !kernel.serial)
    kernel.serial = std::make_shared<Serial>(p, kernel);
  kernel.runsSerially = serially;
}

/// Orders and bins the input over threads.
[[gnu::noinline]] static void
prepareThreads(pikort_pipeline &p, const Stage &stage, Kernel &kernel) {
  if (stage.keyWidth > 0)
    kernel.keys = std::move(kernel.stream.keys);
  bool rankNeeded = false;
  for (int32_t e : stage.outputs)
    if (e >= 0 && !p.edges[e].local && stage.loop < 0)
      rankNeeded |= p.edges[e].keyed() || p.edges[e].gather == PIKOIR_PERMUTE;
  binItems(p, stage, kernel, rankNeeded);
  cutUnits(p, stage, kernel);
  if (p.ranks)
    p.ranks->noteBins(stage, kernel);
  prepareOutputs(p, stage, kernel);
  openLanes(p, kernel);
}

/// Whether a kernel changes state: its stage, or one after it.
static bool writesState(const pikort_pipeline &p, const Kernel &kernel) {
  return p.stages[kernel.stage].writes() ||
         std::any_of(p.stages.begin(), p.stages.end(), [&](const Stage &stage) {
           return stage.host == kernel.stage && stage.writes();
         });
}

static void prepareStage(pikort_pipeline &p, Kernel &kernel) {
  Stage &stage = p.stages[kernel.stage];
  Cycle *cycle = cycleOf(p, stage);
  Strips *strips = stripsOf(p, stage);
  StageStats &stats = p.stageStats[kernel.stage];
  if (kernel.runsSerially) {
    Items input = cycle->serialInput(kernel);
    kernel.serial->begin(input);
    if (p.ranks)
      p.ranks->noteBuckets(stage, input);
    stats.in += input.count;
  } else {
    kernel.stream =
        cycle ? cycle->takeInput(kernel) : gatherInputs(p, stage, true);
    stats.in += kernel.stream.count;
  }
  if (strips && stage.collects())
    kernel.launch = strips->number();
  if (!kernel.runsSerially)
    prepareThreads(p, stage, kernel);
  if (strips && writesState(p, kernel))
    strips->commit();
  stats.placed += kernel.positions;
}

/// The name of a kernel, for errors.
static auto nameOf(const pikort_pipeline &p, const Kernel &kernel) {
  return
      [&p, &kernel] { return "stage " + quoted(p.stages[kernel.stage].name); };
}

[[gnu::cold, gnu::noinline]] static void failInterrupted(pikort_pipeline &p,
                                                         Kernel &kernel) {
  throw Failure{PIKORT_INTERRUPTED, "pipeline " + quoted(p.name) +
                                        ": interrupted before stage " +
                                        quoted(p.stages[kernel.stage].name)};
}

static const pikoir_input *begin(pikort_pipeline &p, Kernel &kernel) {
  if (p.status != PIKORT_OK)
    return nullptr;
  p.runningKernel = 2 * p.stages[kernel.stage].launchOrder -
                    static_cast<int32_t>(kernel.source >= 0);
  int32_t code = guarded(&p, nameOf(p, kernel), [&] {
    if (p.interrupted.load(std::memory_order_relaxed)) [[unlikely]]
      failInterrupted(p, kernel);
    chooseLaunch(p, kernel);
    // What a serial launch takes is its cycle's time.
    if (!kernel.runsSerially)
      kernel.started = p.profile.enter(Part::Join);
    if (kernel.source >= 0)
      prepareSource(p, kernel);
    else
      prepareStage(p, kernel);
    if (kernel.source < 0) {
      beginClears(p, kernel);
      beginReductions(p, kernel);
      beginSelections(p, kernel);
    }
    kernel.open = true;
    if (kernel.tuner && !kernel.runsSerially)
      kernel.tuner->beginLaunch(kernel.units);
    kernel.cursors.reset(kernel.units, p.threads, kernel.input);
    int64_t threads = std::min(kernel.mostThreads, p.threads);
    cpuOf(p).activeThreads = kernel.runsSerially
                                 ? 1
                                 : static_cast<int32_t>(std::clamp<int64_t>(
                                       kernel.input.unit_count, 1, threads));
  });
  if (code == PIKORT_OK && kernel.runsSerially &&
      kernel.positions <= Serial::fewest)
    kernel.isMeasured = p.profile.beginSmall();
  else
    kernel.begun =
        p.profile.enter(code == PIKORT_OK ? Part::Kernel : Part::Program);
  const pikoir_input *input = nullptr;
  if (code == PIKORT_OK)
    guarded(&p, nameOf(p, kernel), [&] { input = cpuOf(p).show(kernel); });
  return input;
}

/// Counts what a launch over threads emitted and how long they waited, and
/// frees what nothing needs that comes after.
[[gnu::noinline]] static void endThreads(pikort_pipeline &p, Kernel &kernel,
                                         int32_t status) {
  KernelStats &stats = p.kernelStats[kernel.statsIndex];
  int64_t busy = 0;
  for (auto &lane : kernel.lanes) {
    busy += lane->busy;
    if (kernel.source < 0)
      p.stageStats[kernel.stage].out += lane->emitted;
  }
  if (kernel.tuner)
    kernel.tuner->endLaunch(busy);
  if (cpuOf(p).activeThreads > 1) {
    ++stats.parallelLaunches;
    stats.waitTicks += std::max<int64_t>(0, kernel.ended - kernel.begun -
                                                busy / cpuOf(p).activeThreads);
  }
  endLocals(p, kernel, status);
  kernel.stream = {};
  kernel.input = {};
  if (kernel.pendingOutputs == 0 || status != PIKORT_OK)
    kernel.clear();
}

/// Takes what was emitted to where it waits; returns the status.
static int32_t takeOutputs(pikort_pipeline &p, Kernel &kernel, bool serially) {
  Cycle *cycle = cycleOf(p, p.stages[kernel.stage]);
  if (cycle)
    return guarded(&p, nameOf(p, kernel),
                   [&] { cycle->absorb(kernel, serially); });
  if (Strips *strips = stripsOf(p, p.stages[kernel.stage]))
    strips->absorb(kernel);
  return p.status.load();
}

/// Counts what a serial launch took, or those since one that was measured.
static void endMeasurement(pikort_pipeline &p, Kernel &kernel) {
  KernelStats &stats = p.kernelStats[kernel.statsIndex];
  if (kernel.positions > Serial::fewest) {
    int64_t took = p.profile.enter(Part::Cycle) - kernel.begun;
    kernel.serial->noteTicks(took);
    stats.ticks += took;
  } else if (kernel.isMeasured) {
    stats.ticks += p.profile.endSmall();
  }
}

static int32_t end(pikort_pipeline &p, Kernel &kernel) {
  int32_t status = p.settle();
  if (!kernel.open)
    return status;
  bool serially = std::exchange(kernel.runsSerially, false);
  KernelStats &stats = p.kernelStats[kernel.statsIndex];
  ++stats.launches;
  kernel.open = false;
  if (serially) {
    endMeasurement(p, kernel);
    if (status != PIKORT_OK)
      kernel.clear();
  } else {
    kernel.ended = p.profile.enter(Part::Join);
    endReductions(p, kernel);
    endSelections(p, kernel);
    endThreads(p, kernel, status);
  }
  cpuOf(p).activeThreads = p.threads;
  if (kernel.source < 0 && status == PIKORT_OK)
    status = takeOutputs(p, kernel, serially);
  if (serially)
    return status;
  int64_t now = p.profile.enter(
      cycleOf(p, p.stages[kernel.stage]) ? Part::Cycle : Part::Program);
  stats.ticks += now - kernel.started;
  stats.joinTicks += kernel.begun - kernel.started + now - kernel.ended;
  return status;
}

[[gnu::cold, gnu::noinline]] static void
failFind(pikort_pipeline *p, int32_t index, const char *what) noexcept {
  guarded(p, "run", [&] {
    throw Failure{PIKORT_BAD_PROGRAM, std::string("expected the number of a ") +
                                          what + ", but got " +
                                          std::to_string(index)};
  });
}

/// The kernel of a stage or a source, or null and an error.
static inline Kernel *find(pikort_pipeline *p, auto &list, int32_t index,
                           const char *what) noexcept {
  if (static_cast<size_t>(index) < list.size())
    if (Kernel *kernel = list[index].get()) [[likely]]
      return kernel;
  failFind(p, index, what);
  return nullptr;
}

/// Reports what generated code has found.
static void fail(pikort_pipeline &p, KernelError found) {
  if (const Stage *stage = p.findStage(found.stage))
    found.depth = stage->depth;
  p.report(found);
}

extern "C" {

const pikoir_input *pikoir_begin(pikort_pipeline *p, int32_t stage) {
  Kernel *kernel = find(p, cpuOf(*p).kernels, stage, "stage");
  if (Checker *checker = checkerOf(*p); kernel && checker)
    checker->beginStage(stage);
  return kernel ? begin(*p, *kernel) : nullptr;
}

int32_t pikoir_end(pikort_pipeline *p, int32_t stage) {
  Kernel *kernel = find(p, cpuOf(*p).kernels, stage, "stage");
  if (Checker *checker = checkerOf(*p))
    checker->endStage();
  return kernel ? end(*p, *kernel) : p->status.load();
}

const pikoir_input *pikoir_begin_source(pikort_pipeline *p, int32_t source) {
  Kernel *kernel = find(p, cpuOf(*p).sourceKernels, source, "placed source");
  return kernel ? begin(*p, *kernel) : nullptr;
}

int32_t pikoir_end_source(pikort_pipeline *p, int32_t source) {
  Kernel *kernel = find(p, cpuOf(*p).sourceKernels, source, "placed source");
  return kernel ? end(*p, *kernel) : p->status.load();
}

void pikoir_fail(pikort_pipeline *p, int32_t stage, const char *name,
                 int64_t bin, int32_t code, int64_t a, int64_t b) {
  fail(*p, {.unit = INT64_MAX,
            .code = code == PIKORT_OK ? PIKORT_BAD_PROGRAM : code,
            .stage = stage,
            .a = a,
            .b = b,
            .bin = bin,
            .name = name ? name : ""});
}

void pikoir_fail_index(pikort_pipeline *p, int32_t stage, const char *name,
                       int64_t bin, int32_t state, int64_t index,
                       int64_t elements) {
  fail(*p, {.unit = INT64_MAX,
            .code = PIKORT_INDEX_OUTSIDE,
            .stage = stage,
            .a = index,
            .b = elements,
            .bin = bin,
            .name = name ? name : "",
            .state = state});
}

void pikoir_fail_barrier(pikort_pipeline *p, int32_t stage, const char *barrier,
                         int64_t bin, int64_t iteration) {
  fail(*p, {.unit = INT64_MAX,
            .code = PIKORT_NOT_UNIFORM,
            .stage = stage,
            .a = iteration,
            .b = 0,
            .bin = bin,
            .barrier = barrier});
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
