//===- Work.cpp - How much a frame does, and how much it must -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Work.h"

#include "Piko/CommandLine/Progress.h"
#include "pikort/abi_setup.h"

#include <algorithm>
#include <map>
#include <set>

using namespace piko;
using namespace piko::render;

namespace {

/// Sums up the counters of one pipeline.
class Collector {
public:
  Collector(Work &work, pikort_pipeline *pipeline)
      : work(work), pipeline(pipeline) {}
  Result<Done> collect();

private:
  void addStages();
  void add(int32_t index, const pikort_counter &counter);
  int64_t countOf(int32_t index);
  void addCode(const pikort_counter &counter);

  Work &work;
  pikort_pipeline *pipeline;
  std::map<int32_t, size_t> loops; ///< By their counters.
};

} // namespace

void Collector::addStages() {
  for (int32_t i = 0; i < pikort_stage_count(pipeline); ++i) {
    pikort_stage_stats stats{};
    pikort_get_stage_stats(pipeline, i, &stats);
    StageWork added;
    added.name = stats.name;
    added.primitives = stats.in;
    pikort_stage_info info{};
    pikort_get_stage_info(pipeline, i, &info);
    added.takesList = info.flags & PIKOIR_LIST;
    work.stages.push_back(added);
  }
}

/// The one of that name, which is added where there is none.
template <class T> static T &find(std::vector<T> &all, const char *name) {
  for (T &known : all)
    if (known.name == name)
      return known;
  all.emplace_back().name = name;
  return all.back();
}

static void add(CodeWork &to, const pikort_counter &counter) {
  switch (counter.kind) {
  case PIKORT_SCALARS:
    to.scalars += counter.count;
    break;
  case PIKORT_VECTORS:
    to.vectors += counter.count;
    break;
  case PIKORT_LANES:
    to.lanes += counter.count;
    break;
  default:
    to.active += counter.count;
  }
}

void Collector::addCode(const pikort_counter &counter) {
  KernelWork &kernel = find(work.kernels, counter.stage);
  ::add(kernel.all, counter);
  bool isLoop = counter.around >= 0 && counter.place;
  ::add(isLoop ? kernel.loops[counter.place] : kernel.outside, counter);
}

int64_t Collector::countOf(int32_t index) {
  pikort_counter counter{};
  pikort_get_counter(pipeline, index, &counter);
  return counter.count;
}

void Collector::add(int32_t index, const pikort_counter &counter) {
  StageWork &of = find(work.stages, counter.stage);
  switch (counter.kind) {
  case PIKORT_CALLS:
    of.calls += counter.count;
    return;
  case PIKORT_FLOATS:
    of.floats += counter.count;
    return;
  case PIKORT_INTEGERS:
    of.integers += counter.count;
    return;
  case PIKORT_ITERATIONS:
  case PIKORT_TRIPS:
    work.loops.push_back({counter.stage, counter.place ? counter.place : "",
                          counter.kind == PIKORT_ITERATIONS, counter.count,
                          countOf(counter.around), 0});
    loops[index] = work.loops.size() - 1;
    return;
  case PIKORT_EFFECTS:
    work.loops[loops.at(counter.around)].effects += counter.count;
    return;
  case PIKORT_EMISSIONS:
    of.emissions += counter.count;
    if (counter.consumer)
      work.edges.push_back({counter.stage, counter.consumer, counter.port,
                            counter.count, counter.bytes, 0});
    return;
  case PIKORT_UPDATES:
    of.updates += counter.count;
    [[fallthrough]];
  default:
    work.accesses.push_back({counter.stage, counter.state, counter.kind,
                             counter.count, counter.bytes, counter.distinct,
                             counter.distinct_bytes});
  }
}

Result<Done> Collector::collect() {
  for (int32_t i = 0; i < pikort_counter_count(pipeline); ++i) {
    pikort_counter counter;
    if (pikort_get_counter(pipeline, i, &counter) != PIKORT_OK)
      return Error{pikort_message(pipeline)};
    bool isCode = counter.kind >= PIKORT_SCALARS;
    if (!isCode && i == 0)
      addStages();
    isCode ? addCode(counter) : add(i, counter);
  }
  return Done{};
}

/// Runs a frame that counts, into `work`.
static Result<Done> countFrame(Options options, SceneInput &scene,
                               Counting count, Work &work) {
  options.load.target = ExecutionTarget::CPU;
  options.load.check = {};
  options.load.gpu = {};
  options.load.synthesis.count = count;
  options.memoryBudget = options.stripSize = 0; // without strips all is stored
  auto frame = Frame::load(options, /*wasCompiled=*/true);
  if (!frame)
    return frame.error();
  if (auto ok = frame->bind(options, scene); !ok)
    return ok.error();
  Progress progress("counting the work of a frame");
  if (auto ok = frame->run(); !ok)
    return ok.error();
  return Collector(work, frame->pipeline()).collect();
}

/// How many elements of state a stage and those after it write.
static int64_t countWritten(const Work &work, const std::string &stage) {
  std::set<std::string> after = {stage};
  for (bool grows = true; grows;) {
    grows = false;
    for (const EdgeWork &edge : work.edges)
      if (after.contains(edge.from))
        grows |= after.insert(edge.to).second;
  }
  std::map<std::string, int64_t> written; // of a piece of state
  for (const AccessWork &access : work.accesses)
    if (access.kind != PIKORT_READS && after.contains(access.stage)) {
      int64_t &most = written[access.state];
      most = std::max(most, access.distinct);
    }
  int64_t most = 0;
  for (const auto &[state, count] : written)
    most = std::max(most, count);
  return most;
}

/// What the timed program stores of what comes into a stage, in a frame.
static int64_t countStored(pikort_pipeline *timed, const std::string &stage) {
  int64_t runs = std::max<int64_t>(1, pikort_stats_runs(timed));
  for (int32_t i = 0; i < pikort_stage_count(timed); ++i) {
    pikort_stage_stats stats{};
    pikort_stage_info info{};
    pikort_record_info record{};
    if (pikort_get_stage_stats(timed, i, &stats) == PIKORT_OK &&
        stats.name == stage &&
        pikort_get_stage_info(timed, i, &info) == PIKORT_OK &&
        pikort_get_record(timed, info.record, &record) == PIKORT_OK)
      return stats.in / runs * record.size;
  }
  return 0; // nothing: it runs where the primitive is made
}

/// Of what a stage stores, the part of an edge by its primitives.
static int64_t shareOf(const Work &work, const EdgeWork &edge, int64_t stored) {
  double all = 0;
  for (const EdgeWork &other : work.edges)
    if (other.to == edge.to)
      all += double(other.primitives);
  return all > 0 ? int64_t(double(stored) * double(edge.primitives) / all) : 0;
}

Result<Work> render::measureWork(const Options &options, SceneInput &scene,
                                 pikort_pipeline *timed) {
  Work work;
  for (Counting count : {Counting::Work, Counting::Lanes})
    if (auto ok = countFrame(options, scene, count, work); !ok)
      return ok.error();
  for (StageWork &stage : work.stages) {
    int64_t written = countWritten(work, stage.name);
    stage.least = written ? std::min(stage.calls, written) : stage.calls;
  }
  if (options.load.target == ExecutionTarget::CPU)
    for (EdgeWork &edge : work.edges)
      edge.stored = shareOf(work, edge, countStored(timed, edge.to));
  return work;
}
