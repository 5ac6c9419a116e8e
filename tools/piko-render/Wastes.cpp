//===- Wastes.cpp - What a frame does in vain -----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Wastes.h"

#include <algorithm>
#include <cstdio>
#include <tuple>

using namespace piko;
using namespace piko::render;

namespace {

/// What is less than this is no waste.
constexpr double leastMilliseconds = 0.01;

class WasteFinder {
public:
  WasteFinder(const Work &work, pikort_pipeline *timed)
      : work(work), timed(timed),
        runs(double(std::max<int64_t>(1, pikort_stats_runs(timed)))) {
    pikort_get_time_stats(timed, &time);
    for (const StageWork &stage : work.stages)
      operations += double(stage.operations());
  }
  std::vector<Waste> find(bool isCPU);

private:
  void addCalls(const StageWork &stage);
  void addTurns(const LoopWork &loop);
  void addKernel(const KernelWork &kernel);
  void addLanes(const CodeWork &code, double milliseconds,
                const std::string &where);
  void addTimes();
  void addStored();
  void add(double milliseconds, std::string what, std::string advice) {
    if (milliseconds >= leastMilliseconds)
      wastes.push_back({milliseconds, std::move(what), std::move(advice)});
  }
  /// Milliseconds of a frame that a stage takes, by its operations.
  double timeOf(const StageWork &stage) const {
    return operations > 0
               ? time.kernels / runs * double(stage.operations()) / operations
               : 0;
  }
  bool fillsPixels(const StageWork &stage) const;
  double timeOfKernel(const std::string &name) const;

  const Work &work;
  pikort_pipeline *timed;
  double runs, operations = 0;
  pikort_time_stats time{};
  std::vector<Waste> wastes;
};

} // namespace

static std::string text(double number) {
  char digits[32];
  std::snprintf(digits, sizeof digits, "%.3g", number);
  return digits;
}

double WasteFinder::timeOfKernel(const std::string &name) const {
  for (int32_t i = 0; i < pikort_kernel_count(timed); ++i) {
    pikort_kernel_stats stats{};
    if (pikort_get_kernel_stats(timed, i, &stats) == PIKORT_OK &&
        stats.name == name)
      return std::max(0.0, stats.milliseconds - stats.join_milliseconds -
                               stats.wait_milliseconds) /
             runs;
  }
  return 0;
}

/// Whether a loop of the stage emits or updates, as that of a rasterizer does.
bool WasteFinder::fillsPixels(const StageWork &stage) const {
  return std::any_of(work.loops.begin(), work.loops.end(),
                     [&](const LoopWork &loop) {
                       return loop.stage == stage.name && loop.effects > 0;
                     });
}

void WasteFinder::addCalls(const StageWork &stage) {
  double calls = double(stage.calls), least = double(stage.least);
  double primitives = double(stage.primitives);
  // A list is taken once for each bin, however many primitives it holds.
  if (!stage.takesList && primitives > 0 && calls > 1.5 * primitives)
    add(timeOf(stage) * (1 - primitives / calls),
        stage.name + " is called " + text(calls / primitives) +
            " times for each primitive, once for each of its bins",
        "larger bins, or no bins (0) where the stage needs none");
  double needed = std::min(calls, std::max(least, calls - primitives));
  if (least > 0 && primitives > 1.5 * least)
    add(timeOf(stage) * (1 - needed / calls),
        stage.name + " takes " + text(primitives / least) +
            " primitives for each element that it or a stage after it writes",
        !fillsPixels(stage)
            ? "shade what is visible alone: let an update keep the nearest, "
              "and "
              "shade pixels after it (endBin or endStage), or test depth "
              "before the stage"
            : "leave out primitives earlier (culling), or take a coarser level "
              "of detail");
}

void WasteFinder::addTurns(const LoopWork &loop) {
  double looked = double(loop.iterations), used = double(loop.effects);
  if (used == 0 || looked <= 1.5 * used)
    return;
  for (const StageWork &stage : work.stages)
    if (stage.name == loop.stage)
      add(timeOf(stage) * (1 - used / looked),
          stage.name + " looks at " + text(looked / used) +
              " places for each that it changes, at " + loop.place,
          "a tighter range of the loop, or smaller bins, which end it");
}

/// Of code whose vectors take so long.
void WasteFinder::addLanes(const CodeWork &code, double milliseconds,
                           const std::string &where) {
  if (code.lanes == 0)
    return;
  double active = double(code.active), vectors = double(code.vectors);
  add(milliseconds * (1 - active / double(code.lanes)),
      text(active / vectors) + " of " + text(double(code.lanes) / vectors) +
          " lanes are at work " + where,
      "specifyLanes(Items) where each primitive has few iterations, "
      "specifyLanes(Iterations) where it has many; larger bins; or primitives "
      "in an order in which neighbours do alike");
}

void WasteFinder::addKernel(const KernelWork &kernel) {
  double instructions = double(kernel.all.scalars + kernel.all.vectors);
  if (instructions == 0)
    return;
  double time = timeOfKernel(kernel.name);
  auto timeOf = [&](int64_t count) {
    return time * double(count) / instructions;
  };
  addLanes(kernel.outside, timeOf(kernel.outside.vectors),
           "in " + kernel.name + ", outside of loops");
  for (const auto &[place, code] : kernel.loops)
    addLanes(code, timeOf(code.vectors),
             "in the loop of " + kernel.name + " at " + place);
  // What vectors of eight lanes would leave of it.
  add(timeOf(kernel.all.scalars) * 7 / 8,
      text(100 * double(kernel.all.scalars) / instructions) + " % of what " +
          kernel.name + " executes is scalar",
      "see why by pikoc --remarks: loops without order become vectors");
}

void WasteFinder::addTimes() {
  add(time.waiting / runs, "threads wait for the last units of kernels",
      "specifySchedule(LoadBalance), smaller bins, or a smaller tile split");
  add(time.joins / runs, "primitives are put in order and into bins",
      "the same bins in stages that follow each other, so that they fuse; "
      "larger bins; or Unordered, where no order is needed");
  add(time.cycles / runs, "cycles of stages keep their order",
      "Unordered, where no order is needed");
  add(time.clears / runs, "images and buffers are cleared",
      "fewer images, or one kernel that updates them, which clears by bins");
  add(time.allocation / runs, "memory is mapped",
      "more frames: what a frame needs is kept for the next");
}

void WasteFinder::addStored() {
  constexpr double bytesPerMillisecond = 10e6; // of memory, both ways
  for (const EdgeWork &edge : work.edges)
    add(2 * double(edge.stored) / bytesPerMillisecond,
        text(double(edge.stored) / 1e6) + " MB go from " + edge.from + " to " +
            edge.to + " through memory",
        "the same bins and no wait between " + edge.from + " and " + edge.to +
            ": pikoc --explain says what keeps them apart");
}

std::vector<Waste> WasteFinder::find(bool isCPU) {
  for (const StageWork &stage : work.stages)
    addCalls(stage);
  for (const LoopWork &loop : work.loops)
    addTurns(loop);
  if (isCPU)
    for (const KernelWork &kernel : work.kernels)
      addKernel(kernel);
  addTimes();
  addStored();
  std::sort(wastes.begin(), wastes.end(), [](const Waste &a, const Waste &b) {
    return std::tie(b.milliseconds, a.what) < std::tie(a.milliseconds, b.what);
  });
  return wastes;
}

std::vector<Waste> render::findWastes(const Work &work, pikort_pipeline *timed,
                                      bool isCPU) {
  return WasteFinder(work, timed).find(isCPU);
}

std::string render::printWastes(const std::vector<Waste> &wastes) {
  if (wastes.empty())
    return "no waste was found\n";
  std::string all = "the largest wastes, estimated:\n";
  for (size_t i = 0; i < std::min<size_t>(3, wastes.size()); ++i) {
    char line[64];
    std::snprintf(line, sizeof line,
                  "  %.2f ms a frame: ", wastes[i].milliseconds);
    all += line + wastes[i].what + "\n    try: " + wastes[i].advice + "\n";
  }
  return all;
}

Json render::reportWastes(const std::vector<Waste> &wastes) {
  Json reports = Json::array();
  for (const Waste &waste : wastes)
    reports.push_back(
        Json::object({{"ms", roundToThousandths(waste.milliseconds)},
                      {"what", waste.what},
                      {"advice", waste.advice}}));
  return reports;
}
