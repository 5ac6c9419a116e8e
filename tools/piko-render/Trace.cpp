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

JsonObject makeEvent(const pikort_unit_run &unit) {
  JsonObject bins;
  bins.add("bins begin", unit.bin_begin)
      .add("bins end", unit.bin_end)
      .add("primitives", unit.primitives);
  return JsonObject()
      .add("name", unit.stage)
      .add("ph", "X") // complete: with a duration, in microseconds
      .add("pid", 0)
      .add("tid", unit.thread)
      .add("ts", unit.begin * 1000)
      .add("dur", (unit.end - unit.begin) * 1000)
      .add("args", bins);
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

  std::vector<JsonObject> events;
  // Marks at the frame's begin: which versions of loops the units run.
  for (const pikort_mapping_info &info : readMappings(pipeline))
    events.push_back(
        JsonObject()
            .add("name", std::string(info.kernel) + ": " + info.loop)
            .add("ph", "i")
            .add("s", "g") // of the whole trace
            .add("pid", 0)
            .add("tid", 0)
            .add("ts", 0)
            .add("args", JsonObject()
                             .add("runs", nameVersion(info.vectors))
                             .add("because", explainMapping(info))
                             .add("expected ratio", info.expected_ratio)
                             .add("measured ratio", info.measured_ratio)));
  for (const pikort_unit_run &unit : units.list)
    events.push_back(makeEvent(unit));
  return support::writeFile(
      path, JsonObject().add("traceEvents", events).text() + "\n");
}
