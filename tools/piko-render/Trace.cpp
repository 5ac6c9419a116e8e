// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Trace.h"

#include "Mappings.h"

#include "Piko/Scene/Json.h"
#include "Piko/Support/OutputFile.h"

#include <mutex>
#include <vector>

using namespace piko;
using namespace piko::render;

namespace {

struct Units {
  std::mutex mutex;
  std::vector<pikort_unit_run> list;
};

Json makeEvent(const pikort_unit_run &unit) {
  Json bins = Json::object();
  bins["bins begin"] = unit.bin_begin;
  bins["bins end"] = unit.bin_end;
  bins["primitives"] = unit.primitives;
  return Json::object(
      {{"name", unit.stage},
       {"ph", "X"}, // complete: with a duration, in microseconds
       {"pid", 0},
       {"tid", unit.thread},
       {"ts", roundToThousandths(unit.begin * 1000)},
       {"dur", roundToThousandths((unit.end - unit.begin) * 1000)},
       {"args", bins}});
}

} // namespace

Result<Done> piko::render::traceFrame(pikort_pipeline *pipeline,
                                      const std::string &path) {
  Units units;
  auto note = [](void *data, const pikort_unit_run *unit) {
    auto &to = *static_cast<Units *>(data);
    std::lock_guard<std::mutex> lock(to.mutex);
    to.list.push_back(*unit);
  };
  pikort_set_unit_report(pipeline, note, &units);
  int32_t status = pikort_run(pipeline);
  pikort_set_unit_report(pipeline, nullptr, nullptr);
  if (status != PIKORT_OK)
    return Error{pikort_message(pipeline)};

  Json events = Json::array();
  // Marks at the frame's begin: which versions of loops the units run.
  for (const pikort_mapping_info &info : readMappings(pipeline))
    events.push_back(Json::object(
        {{"name", std::string(info.kernel) + ": " + info.loop},
         {"ph", "i"},
         {"s", "g"}, // of the whole trace
         {"pid", 0},
         {"tid", 0},
         {"ts", 0},
         {"args", Json::object({{"runs", nameVersion(info.vectors)},
                                {"because", explainMapping(info)},
                                {"expected ratio",
                                 roundToThousandths(info.expected_ratio)},
                                {"measured ratio",
                                 roundToThousandths(info.measured_ratio)}})}}));
  for (const pikort_unit_run &unit : units.list)
    events.push_back(makeEvent(unit));
  return support::writeFile(
      path, writeLine(Json::object({{"traceEvents", events}})) + "\n");
}
