//===- WorkReport.cpp - What was counted, as JSON and as tables -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Work.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>

using namespace piko;
using namespace piko::render;

/// How many times as much as is needed; 1 where nothing is done.
static double ratio(int64_t done, int64_t needed) {
  return done ? double(done) / double(std::max<int64_t>(1, needed)) : 1;
}

static const char *describeAccess(int32_t kind) {
  switch (kind) {
  case PIKORT_READS:
    return "reads";
  case PIKORT_STORES:
    return "stores";
  case PIKORT_UPDATES:
    return "updates";
  default:
    return "atomics";
  }
}

//===----------------------------------------------------------------------===//
// JSON
//===----------------------------------------------------------------------===//

static Json reportStage(const StageWork &stage) {
  return Json::object(
      {{"name", stage.name},
       {"primitives", stage.primitives},
       {"calls", stage.calls},
       {"least", stage.least},
       {"ratio", roundToThousandths(ratio(stage.calls, stage.least))},
       {"updates", stage.updates},
       {"emissions", stage.emissions},
       {"floats", stage.floats},
       {"integers", stage.integers}});
}

static Json reportEdge(const EdgeWork &edge) {
  return Json::object({{"from", edge.from},
                       {"port", edge.port},
                       {"to", edge.to},
                       {"primitives", edge.primitives},
                       {"bytes", edge.bytes},
                       {"stored", edge.stored}});
}

static Json reportAccess(const AccessWork &access) {
  return Json::object({{"stage", access.stage},
                       {"state", access.state},
                       {"kind", describeAccess(access.kind)},
                       {"count", access.count},
                       {"bytes", access.bytes},
                       {"elements", access.distinct},
                       {"least", access.distinctBytes},
                       {"ratio", roundToThousandths(ratio(
                                     access.bytes, access.distinctBytes))}});
}

static Json reportLoop(const LoopWork &loop) {
  return Json::object({{"stage", loop.stage},
                       {"place", loop.place},
                       {"parallel", int(loop.isParallel)},
                       {"iterations", loop.iterations},
                       {"around", loop.around},
                       {"effects", loop.effects}});
}

static Json reportCode(const CodeWork &code) {
  return Json::object(
      {{"scalars", code.scalars},
       {"vectors", code.vectors},
       {"lanes", code.lanes},
       {"active_lanes", code.active},
       {"ratio", roundToThousandths(ratio(code.lanes, code.active))}});
}

static Json reportKernel(const KernelWork &kernel) {
  Json report = reportCode(kernel.all), loops = Json::array();
  report["name"] = kernel.name;
  for (const auto &[place, code] : kernel.loops) {
    loops.push_back(reportCode(code));
    loops.back()["place"] = place;
  }
  report["loops"] = loops;
  return report;
}

template <class T>
static Json reportAll(const std::vector<T> &all, Json (*report)(const T &)) {
  Json reports = Json::array();
  for (const T &one : all)
    reports.push_back(report(one));
  return reports;
}

Json render::reportWork(const Work &work) {
  return Json::object({{"stages", reportAll(work.stages, reportStage)},
                       {"edges", reportAll(work.edges, reportEdge)},
                       {"accesses", reportAll(work.accesses, reportAccess)},
                       {"loops", reportAll(work.loops, reportLoop)},
                       {"kernels", reportAll(work.kernels, reportKernel)}});
}

//===----------------------------------------------------------------------===//
// Tables
//===----------------------------------------------------------------------===//

/// A line, as printf has it.
__attribute__((format(printf, 2, 3))) static void
print(std::string &to, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  char line[512];
  std::vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  to += line;
  to += '\n';
}

/// With a unit of 1000s after it where it is large.
static std::string shorten(int64_t number) {
  char text[32];
  double value = double(number);
  const char *units[] = {"", " k", " M", " G", " T"};
  size_t unit = 0;
  for (; value >= 10'000 && unit + 1 < std::size(units); ++unit)
    value /= 1000;
  std::snprintf(text, sizeof text, unit ? "%.4g%s" : "%.0f%s", value,
                units[unit]);
  return text;
}

static void printStages(std::string &text, const Work &work, int64_t pixels) {
  print(text, "\nwhat the text does: %lld pixels are drawn",
        static_cast<long long>(pixels));
  print(text, "  %-22s %10s %10s %7s %10s %10s %10s", "stage", "calls",
        "needed", "ratio", "a pixel", "floats", "integers");
  for (const StageWork &stage : work.stages)
    print(text, "  %-22s %10s %10s %7.2f %10.3g %10s %10s", stage.name.c_str(),
          shorten(stage.calls).c_str(), shorten(stage.least).c_str(),
          ratio(stage.calls, stage.least),
          double(stage.calls) / double(std::max<int64_t>(1, pixels)),
          shorten(stage.floats).c_str(), shorten(stage.integers).c_str());
}

static void printLoops(std::string &text, const Work &work) {
  if (work.loops.empty())
    return;
  print(text, "  %-22s %10s %10s %10s  %s", "loops of", "iterations",
        "each time", "effects", "at");
  for (const LoopWork &loop : work.loops)
    if (loop.iterations)
      print(text, "  %-22s %10s %10.4g %10s  %s%s", loop.stage.c_str(),
            shorten(loop.iterations).c_str(),
            ratio(loop.iterations, loop.around), shorten(loop.effects).c_str(),
            loop.place.c_str(), loop.isParallel ? ", parallel" : "");
}

static void printEdges(std::string &text, const Work &work) {
  if (work.edges.empty())
    return;
  print(text, "  %-45s %10s %10s %10s", "edges", "primitives", "bytes",
        "stored");
  for (const EdgeWork &edge : work.edges) {
    std::string name =
        edge.from + " port " + std::to_string(edge.port) + " to " + edge.to;
    print(text, "  %-45s %10s %10s %10s", name.c_str(),
          shorten(edge.primitives).c_str(), shorten(edge.bytes).c_str(),
          shorten(edge.stored).c_str());
  }
}

static void printAccesses(std::string &text, const Work &work) {
  if (work.accesses.empty())
    return;
  print(text, "  %-22s %-22s %-8s %10s %10s %10s %7s", "state of", "name", "",
        "times", "bytes", "once each", "ratio");
  for (const AccessWork &access : work.accesses)
    if (access.count)
      print(text, "  %-22s %-22s %-8s %10s %10s %10s %7.2f",
            access.stage.c_str(), access.state.c_str(),
            describeAccess(access.kind), shorten(access.count).c_str(),
            shorten(access.bytes).c_str(),
            shorten(access.distinctBytes).c_str(),
            ratio(access.bytes, access.distinctBytes));
}

static void printKernels(std::string &text, const Work &work) {
  print(text, "what the code does");
  print(text, "  %-22s %10s %10s %10s %10s %7s", "kernel", "scalars", "vectors",
        "lanes", "used", "ratio");
  for (const KernelWork &kernel : work.kernels)
    print(text, "  %-22s %10s %10s %10s %10s %7.2f", kernel.name.c_str(),
          shorten(kernel.all.scalars).c_str(),
          shorten(kernel.all.vectors).c_str(),
          shorten(kernel.all.lanes).c_str(), shorten(kernel.all.active).c_str(),
          ratio(kernel.all.lanes, kernel.all.active));
}

/// Lanes at work in each loop that has vectors of its own.
static void printLanes(std::string &text, const Work &work) {
  bool isFirst = true;
  for (const KernelWork &kernel : work.kernels)
    for (const auto &[place, code] : kernel.loops) {
      if (!code.vectors)
        continue;
      if (std::exchange(isFirst, false))
        print(text, "  %-22s %10s %10s %7s  %s", "lanes in loops of", "vectors",
              "at work", "of", "at");
      print(text, "  %-22s %10s %10.1f %7.3g  %s", kernel.name.c_str(),
            shorten(code.vectors).c_str(), ratio(code.active, code.vectors),
            ratio(code.lanes, code.vectors), place.c_str());
    }
}

std::string render::printWork(const Work &work, int64_t pixels) {
  std::string text;
  printStages(text, work, pixels);
  printLoops(text, work);
  printEdges(text, work);
  printAccesses(text, work);
  printKernels(text, work);
  printLanes(text, work);
  return text;
}
