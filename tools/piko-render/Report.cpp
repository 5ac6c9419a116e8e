//===- Report.cpp - What piko-render says of a run ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Report.h"

#include "Frame.h"
#include "Mappings.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>

using namespace piko;
using namespace piko::render;

namespace {

bool isOnDevice(pikort_pipeline *pipeline) {
  return pikort_device(pipeline) != PIKORT_PROCESSOR;
}

/// "CUDA device 0 (NAME)", or nothing.
std::string nameDevice(pikort_pipeline *pipeline) {
  pikort_device_info info;
  int32_t number = pikort_device(pipeline);
  if (!isOnDevice(pipeline) || pikort_get_device(number, &info) != PIKORT_OK)
    return {};
  return "CUDA device " + std::to_string(number) + " (" + info.name + ")";
}

/// Which versions of its loops a kernel runs, and why.
std::vector<JsonObject> reportMappings(pikort_pipeline *pipeline,
                                       const std::string &kernel) {
  std::vector<JsonObject> mappings;
  for (const pikort_mapping_info &info : readMappings(pipeline))
    if (kernel == info.kernel)
      mappings.push_back(JsonObject()
                             .add("number", info.number)
                             .add("within", info.within)
                             .add("loop", info.loop)
                             .add("runs", nameVersion(info.vectors))
                             .add("expected", nameVersion(info.expected))
                             .add("because", explainMapping(info))
                             .add("expected_ratio", info.expected_ratio)
                             .add("measured_ratio", info.measured_ratio));
  return mappings;
}

/// Where a device has all of a run it is not known what its kernels took,
/// unless somebody has asked for it.
std::vector<JsonObject> reportKernels(pikort_pipeline *pipeline, double runs) {
  std::vector<JsonObject> kernels;
  for (int32_t i = 0; i < pikort_kernel_count(pipeline); ++i) {
    pikort_kernel_stats stats;
    if (pikort_get_kernel_stats(pipeline, i, &stats) != PIKORT_OK)
      continue;
    JsonObject &kernel = kernels.emplace_back();
    kernel.add("name", stats.name);
    bool isKnown = stats.launches > 0 || !isOnDevice(pipeline);
    if (isKnown)
      kernel.add("ms", stats.milliseconds / runs)
          .add("join_ms", stats.join_milliseconds / runs)
          .add("wait_ms", stats.wait_milliseconds / runs)
          .add("launches", double(stats.launches) / runs)
          .add("parallel_launches", double(stats.parallel_launches) / runs);
    if (auto mappings = reportMappings(pipeline, stats.name); !mappings.empty())
      kernel.add("mappings", mappings);
  }
  return kernels;
}

std::vector<JsonObject> reportStages(pikort_pipeline *pipeline, double runs) {
  std::vector<JsonObject> stages;
  for (int32_t i = 0; i < pikort_stage_count(pipeline); ++i) {
    pikort_stage_stats stats;
    if (pikort_get_stage_stats(pipeline, i, &stats) != PIKORT_OK)
      continue;
    stages.push_back(JsonObject()
                         .add("name", stats.name)
                         .add("in", double(stats.in) / runs)
                         .add("placed", double(stats.placed) / runs)
                         .add("out", double(stats.out) / runs));
  }
  return stages;
}

/// The parts of a mean frame, which sum to ms_mean.
JsonObject reportTime(pikort_pipeline *pipeline, double runs) {
  pikort_time_stats stats{};
  pikort_get_time_stats(pipeline, &stats);
  JsonObject report;
  report.add("kernels_ms", stats.kernels / runs)
      .add("waiting_ms", stats.waiting / runs)
      .add("joins_ms", stats.joins / runs)
      .add("cycles_ms", stats.cycles / runs)
      .add("clears_ms", stats.clears / runs)
      .add("allocation_ms", stats.allocation / runs)
      .add("program_ms", stats.program / runs);
  if (isOnDevice(pipeline))
    report.add("device_ms", stats.device / runs);
  return report;
}

JsonObject reportCounts(const std::vector<Count> &counts) {
  JsonObject report;
  for (const Count &count : counts)
    report.add(count.name, count.sum);
  return report;
}

double runsOf(pikort_pipeline *pipeline) {
  return double(std::max<int64_t>(1, pikort_stats_runs(pipeline)));
}

/// What the frames ran on.
const char *nameTarget(const Options &options, pikort_pipeline *pipeline) {
  if (options.load.target == ExecutionTarget::Reference)
    return "reference";
  switch (options.load.gpu.target) {
  case GPUTarget::Emulator:
    return "gpu-on-cpu";
  case GPUTarget::CUDA:
    return "cuda";
  case GPUTarget::Auto:
    return pikort_processor(pipeline) == std::string_view("cuda") ? "cuda"
                                                                  : "cpu";
  default: // a library has code for what it was made for
    return isOnDevice(pipeline) ? "cuda" : "cpu";
  }
}

} // namespace

bool render::isTimed(const Options &options, pikort_pipeline *pipeline) {
  return options.kernelTimes && isOnDevice(pipeline);
}

Result<std::vector<JsonObject>> render::timeKernels(const Options &options,
                                                    pikort_pipeline *pipeline) {
  constexpr int most = 3;
  int frames = std::min(most, options.frames);
  pikort_reset_stats(pipeline);
  bool isRun = pikort_set_kernel_times(pipeline, 1) == PIKORT_OK;
  for (int i = 0; i < frames && isRun; ++i)
    isRun = pikort_run(pipeline) == PIKORT_OK;
  if (!isRun)
    return errorOf(pipeline);
  return reportKernels(pipeline, frames);
}

JsonObject render::makeReport(const Options &options, const RunResult &result,
                              pikort_pipeline *pipeline) {
  double runs = runsOf(pipeline);
  bool isReference = options.load.target == ExecutionTarget::Reference;
  const char *target = nameTarget(options, pipeline);
  std::string name = pikort_name(pipeline);
  JsonObject report;
  report.add("peer", "piko")
      .add("scene", std::filesystem::path(options.scene).filename().string())
      .add("tris", result.triangles)
      .add("verts", result.vertices)
      .add("w", result.width)
      .add("h", result.height)
      .add("lights", options.lights)
      .add("ms_median", result.times.median)
      .add("ms_min", result.times.min)
      .add("ms_max", result.times.max)
      .add("ms_mean", result.times.mean)
      .add("threads", result.threads)
      .add("mode", name + (isReference ? "+reference" : ""))
      .add("pixels", result.pixels)
      .add("image_hash", result.imageHash)
      .add("renderer", std::string("Piko, ") + target)
      .add("pipe", name)
      .add("target", target)
      .add("frames", result.times.count)
      .add("compile_ms", result.compileMilliseconds)
      .add("load_ms", result.loadMilliseconds)
      .add("patches", result.patches)
      .add("counters", reportCounts(result.counts));
  if (isOnDevice(pipeline))
    report.add("device", nameDevice(pipeline));
  if (isReference) // the runtime does not see inside of it
    return report;
  report.add("peak_bin_bytes", pikort_peak_bytes(pipeline))
      .add("time", reportTime(pipeline, runs));
  if (!isTimed(options, pipeline))
    report.add("kernels", reportKernels(pipeline, runs));
  report.add("stages", reportStages(pipeline, runs));
  return report;
}

std::string render::summarize(const RunResult &result,
                              pikort_pipeline *pipeline) {
  std::string where = nameDevice(pipeline);
  if (where.empty())
    where = std::to_string(result.threads) + " threads";
  auto [count, kind] =
      result.primitives > 0 ? std::pair(result.primitives, "primitives")
      : result.patches > 0  ? std::pair(result.patches, "patches")
                            : std::pair(result.triangles, "triangles");
  // A capture need not have an image.
  std::string pixels = result.primitives > 0 && result.pixels == 0
                           ? ""
                           : std::to_string(result.pixels) + " pixels, ";
  char text[512];
  std::snprintf(text, sizeof text,
                "%s: %.2f ms a frame (median of %d, %.2f to %.2f), "
                "%lld %s, %s%s, compiled in %.0f ms",
                pikort_name(pipeline), result.times.median, result.times.count,
                result.times.min, result.times.max,
                static_cast<long long>(count), kind, pixels.c_str(),
                where.c_str(), result.compileMilliseconds);
  return text;
}
