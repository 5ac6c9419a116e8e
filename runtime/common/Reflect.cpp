// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Reflect.cpp - The host API: descriptions and statistics ------------===//

#include "common/Pipeline.h"
#include "ranks/Ranks.h"

using namespace piko::rt;

/// Fills *info from list[index], or explains why not.
template <class List, class Info, class Get>
static int32_t describe(pikort_pipeline *p, const List &list, int32_t index,
                        const char *what, Info *info, Get &&get) noexcept {
  p->clearStatus();
  return guarded(p, "pipeline", [&] {
    if (!info)
      throw Failure{PIKORT_INVALID_ARGUMENT,
                    "expected room for a description, but got null"};
    if (index < 0 || index >= static_cast<int32_t>(list.size()))
      throw Failure{PIKORT_NOT_FOUND, "pipeline " + quoted(p->name) +
                                          " has no " + what + " " +
                                          std::to_string(index)};
    *info = get(list[index]);
  });
}

static int32_t countOf(const auto &list) {
  return static_cast<int32_t>(list.size());
}

extern "C" {

int32_t pikort_rank(const pikort_pipeline *p) { return p ? p->rank : 0; }
int32_t pikort_record_count(const pikort_pipeline *p) {
  return p ? countOf(p->records) : 0;
}
int32_t pikort_state_count(const pikort_pipeline *p) {
  return p ? countOf(p->hostStates()) : 0;
}
int32_t pikort_stage_count(const pikort_pipeline *p) {
  return p ? countOf(p->stages) : 0;
}
int32_t pikort_source_count(const pikort_pipeline *p) {
  return p ? countOf(p->sources) : 0;
}

int32_t pikort_get_record(pikort_pipeline *p, int32_t index,
                          pikort_record_info *info) {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  return describe(p, p->records, index, "record", info, [](const Record &r) {
    return pikort_record_info{r.name.c_str(), r.size, r.align,
                              countOf(r.fields)};
  });
}

int32_t pikort_get_field(pikort_pipeline *p, int32_t record, int32_t index,
                         pikort_field_info *info) {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  static const std::vector<Field> none;
  bool exists = record >= 0 && record < countOf(p->records);
  return describe(p, exists ? p->records[record].fields : none, index, "field",
                  info, [](const Field &f) {
                    return pikort_field_info{f.name.c_str(), f.offset,
                                             f.elements, f.stride, f.type};
                  });
}

int32_t pikort_get_state_info(pikort_pipeline *p, int32_t index,
                              pikort_state_info *info) {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  return describe(p, p->hostStates(), index, "state", info, [](const State &s) {
    bool bound = s.bound || s.kind == PIKORT_IMAGE || s.perSource >= 0;
    return pikort_state_info{s.name.c_str(), s.kind,      s.record,
                             s.rank,         s.perSource, bound};
  });
}

int32_t pikort_get_stage_info(pikort_pipeline *p, int32_t index,
                              pikort_stage_info *info) {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  return describe(p, p->stages, index, "stage", info, [&](const Stage &s) {
    return pikort_stage_info{
        s.name.c_str(),
        {s.binSize[0], s.binSize[1], s.binSize[2], s.binSize[3]},
        s.schedule.tileSplit,
        s.tileSize,
        p->hostRecord(index),
        s.schedule.kind,
        s.flags,
        countOf(s.outputs)};
  });
}

int32_t pikort_get_source_info(pikort_pipeline *p, int32_t index,
                               pikort_source_info *info) {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  return describe(p, p->sources, index, "source", info, [&](const Source &s) {
    return pikort_source_info{s.stage, p->hostRecord(s.stage), s.count};
  });
}

// --- Statistics -------------------------------------------------------------

} // extern "C"

void KernelStats::endRun(double ticksPerMillisecond) {
  auto add = [&](double &sum, int64_t &now) {
    sum += static_cast<double>(std::exchange(now, 0)) / ticksPerMillisecond;
  };
  add(milliseconds, ticks);
  add(joinMilliseconds, joinTicks);
  add(waitMilliseconds, waitTicks);
}

void KernelStats::reset() {
  milliseconds = joinMilliseconds = waitMilliseconds = 0;
  launches = parallelLaunches = 0;
}

extern "C" {

int64_t pikort_stats_runs(const pikort_pipeline *p) { return p ? p->runs : 0; }

int32_t pikort_kernel_count(const pikort_pipeline *p) {
  return p ? countOf(p->kernelStats) : 0;
}

int32_t pikort_get_kernel_stats(pikort_pipeline *p, int32_t index,
                                pikort_kernel_stats *stats) {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  return describe(
      p, p->kernelStats, index, "kernel", stats, [](const KernelStats &k) {
        return pikort_kernel_stats{k.name.c_str(),     k.milliseconds,
                                   k.joinMilliseconds, k.waitMilliseconds,
                                   k.launches,         k.parallelLaunches};
      });
}

int32_t pikort_mapping_count(const pikort_pipeline *p) {
  return p ? countOf(p->mappings) : 0;
}

int32_t pikort_get_mapping(pikort_pipeline *p, int32_t index,
                           pikort_mapping_info *info) {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  return describe(p, p->mappings, index, "mapping", info,
                  [&](const Mapping &m) {
                    return pikort_mapping_info{
                        p->kernelStats[m.kernel].name.c_str(),
                        m.number,
                        m.within,
                        m.loop.c_str(),
                        m.chosen,
                        m.expected,
                        m.state,
                        static_cast<double>(m.vectors) /
                            static_cast<double>(std::max<int64_t>(1, m.scalar)),
                        m.ratio};
                  });
}

int32_t pikort_get_time_stats(pikort_pipeline *p, pikort_time_stats *stats) {
  if (!p || !stats)
    return PIKORT_INVALID_ARGUMENT;
  auto part = [&](Part part) { return p->profile.milliseconds(part); };
  double waiting = 0;
  for (const KernelStats &kernel : p->kernelStats)
    waiting += kernel.waitMilliseconds;
  waiting = std::min(waiting, part(Part::Kernel));
  *stats = {part(Part::Kernel) - waiting,
            waiting,
            part(Part::Join),
            part(Part::Cycle),
            part(Part::State),
            part(Part::Allocation),
            part(Part::Program),
            part(Part::Device)};
  return PIKORT_OK;
}

int32_t pikort_get_stage_stats(pikort_pipeline *p, int32_t stage,
                               pikort_stage_stats *stats) {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  return describe(p, p->stageStats, stage, "stage", stats,
                  [&](const StageStats &s) {
                    return pikort_stage_stats{p->stages[stage].name.c_str(),
                                              s.in, s.placed, s.out};
                  });
}

int64_t pikort_peak_bytes(const pikort_pipeline *p) {
  return p ? p->memory.peak() : 0;
}

int64_t pikort_reserved_bytes(const pikort_pipeline *p) {
  return p ? p->memory.reserved() : 0;
}

void pikort_reset_stats(pikort_pipeline *p) {
  if (!p)
    return;
  for (KernelStats &stats : p->kernelStats)
    stats.reset();
  p->profile.reset();
  for (StageStats &stats : p->stageStats)
    stats = {};
  for (std::unique_ptr<Counter> &counter : p->counters)
    counter->reset();
  if (p->ranks)
    p->ranks->traffic.clear();
  p->runs = 0;
  p->memory.resetPeak();
}

} // extern "C"
