//===- Report.cpp - What piko-render says of a run ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Report.h"

#include "Frame.h"
#include "Mappings.h"

#include <pikort/ranks.h>

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
Json reportMappings(pikort_pipeline *pipeline, const std::string &kernel) {
  Json mappings = Json::array();
  for (const pikort_mapping_info &info : readMappings(pipeline))
    if (kernel == info.kernel)
      mappings.push_back(Json::object(
          {{"number", info.number},
           {"within", info.within},
           {"loop", info.loop},
           {"runs", nameVersion(info.vectors)},
           {"expected", nameVersion(info.expected)},
           {"because", explainMapping(info)},
           {"expected_ratio", roundToThousandths(info.expected_ratio)},
           {"measured_ratio", roundToThousandths(info.measured_ratio)}}));
  return mappings;
}

/// Where a device has all of a run it is not known what its kernels took,
/// unless somebody has asked for it.
Json reportKernels(pikort_pipeline *pipeline, double runs) {
  Json kernels = Json::array();
  for (int32_t i = 0; i < pikort_kernel_count(pipeline); ++i) {
    pikort_kernel_stats stats;
    if (pikort_get_kernel_stats(pipeline, i, &stats) != PIKORT_OK)
      continue;
    Json &kernel = kernels.emplace_back();
    kernel["name"] = stats.name;
    bool isKnown = stats.launches > 0 || !isOnDevice(pipeline);
    if (isKnown) {
      kernel["ms"] = roundToThousandths(stats.milliseconds / runs);
      kernel["join_ms"] = roundToThousandths(stats.join_milliseconds / runs);
      kernel["wait_ms"] = roundToThousandths(stats.wait_milliseconds / runs);
      kernel["launches"] = roundToThousandths(double(stats.launches) / runs);
      kernel["parallel_launches"] =
          roundToThousandths(double(stats.parallel_launches) / runs);
    }
    if (auto mappings = reportMappings(pipeline, stats.name); !mappings.empty())
      kernel["mappings"] = mappings;
  }
  return kernels;
}

Json reportStages(pikort_pipeline *pipeline, double runs) {
  Json stages = Json::array();
  for (int32_t i = 0; i < pikort_stage_count(pipeline); ++i) {
    pikort_stage_stats stats;
    if (pikort_get_stage_stats(pipeline, i, &stats) != PIKORT_OK)
      continue;
    stages.push_back(Json::object(
        {{"name", stats.name},
         {"in", roundToThousandths(double(stats.in) / runs)},
         {"placed", roundToThousandths(double(stats.placed) / runs)},
         {"out", roundToThousandths(double(stats.out) / runs)}}));
  }
  return stages;
}

/// What each rank has sent in a mean frame, and held at most.
Json reportRanks(pikort_pipeline *pipeline, double runs) {
  Json ranks = Json::array();
  for (int32_t rank = 0; rank < pikort_rank_count(pipeline); ++rank) {
    pikort_rank_totals totals{};
    pikort_get_rank_totals(pipeline, rank, &totals);
    ranks.push_back(Json::object(
        {{"bytes", roundToThousandths(double(totals.bytes) / runs)},
         {"peak_bytes", totals.peak}}));
  }
  return ranks;
}

/// The parts of a mean frame, which sum to ms_mean.
Json reportTime(pikort_pipeline *pipeline, double runs) {
  pikort_time_stats stats{};
  pikort_get_time_stats(pipeline, &stats);
  Json report = Json::object();
  report["kernels_ms"] = roundToThousandths(stats.kernels / runs);
  report["waiting_ms"] = roundToThousandths(stats.waiting / runs);
  report["joins_ms"] = roundToThousandths(stats.joins / runs);
  report["cycles_ms"] = roundToThousandths(stats.cycles / runs);
  report["clears_ms"] = roundToThousandths(stats.clears / runs);
  report["allocation_ms"] = roundToThousandths(stats.allocation / runs);
  report["program_ms"] = roundToThousandths(stats.program / runs);
  if (isOnDevice(pipeline))
    report["device_ms"] = roundToThousandths(stats.device / runs);
  return report;
}

Json reportCounts(const std::vector<Count> &counts) {
  Json report = Json::object();
  for (const Count &count : counts)
    report[count.name] = count.sum;
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

Result<Json> render::timeKernels(const Options &options,
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

Json render::makeReport(const Options &options, const RunResult &result,
                        pikort_pipeline *pipeline) {
  double runs = runsOf(pipeline);
  bool isReference = options.load.target == ExecutionTarget::Reference;
  const char *target = nameTarget(options, pipeline);
  std::string name = pikort_name(pipeline);
  Json report = Json::object();
  report["peer"] = "piko";
  report["scene"] = std::filesystem::path(options.scene).filename().string();
  report["tris"] = result.triangles;
  report["verts"] = result.vertices;
  report["w"] = result.width;
  report["h"] = result.height;
  report["lights"] = options.lights;
  report["ms_median"] = roundToThousandths(result.times.median);
  report["ms_min"] = roundToThousandths(result.times.min);
  report["ms_max"] = roundToThousandths(result.times.max);
  report["ms_mean"] = roundToThousandths(result.times.mean);
  report["threads"] = result.threads;
  report["mode"] = name + (isReference ? "+reference" : "");
  report["pixels"] = result.pixels;
  report["image_hash"] = result.imageHash;
  report["renderer"] = std::string("Piko, ") + target;
  report["pipe"] = name;
  report["target"] = target;
  report["frames"] = result.times.count;
  report["compile_ms"] = roundToThousandths(result.compileMilliseconds);
  report["from_cache"] = result.isFromCache ? 1 : 0;
  report["load_ms"] = roundToThousandths(result.loadMilliseconds);
  report["patches"] = result.patches;
  report["counters"] = reportCounts(result.counts);
  if (isOnDevice(pipeline))
    report["device"] = nameDevice(pipeline);
  if (isReference) // the runtime does not see inside of it
    return report;
  report["peak_bin_bytes"] = pikort_peak_bytes(pipeline);
  report["time"] = reportTime(pipeline, runs);
  if (pikort_rank_count(pipeline) > 0)
    report["ranks"] = reportRanks(pipeline, runs);
  if (!isTimed(options, pipeline))
    report["kernels"] = reportKernels(pipeline, runs);
  report["stages"] = reportStages(pipeline, runs);
  return report;
}

std::string render::summarize(const Options &options, const RunResult &result,
                              pikort_pipeline *pipeline) {
  std::string where = nameDevice(pipeline);
  if (where.empty())
    where = std::to_string(result.threads) +
            (result.threads == 1 ? " thread" : " threads");
  auto [count, kind] =
      result.primitives > 0 ? std::pair(result.primitives, "primitives")
      : result.patches > 0  ? std::pair(result.patches, "patches")
                            : std::pair(result.triangles, "triangles");
  // A capture need not have an image.
  std::string pixels = result.primitives > 0 && result.pixels == 0
                           ? ""
                           : std::to_string(result.pixels) + " pixels of " +
                                 std::to_string(result.width) + " x " +
                                 std::to_string(result.height) + ", ";
  char text[512];
  std::snprintf(text, sizeof text,
                "%s: %.2f ms a frame (median of %d, %.2f to %.2f), "
                "%lld %s, %starget %s, %s, compiled in %.0f ms",
                pikort_name(pipeline), result.times.median, result.times.count,
                result.times.min, result.times.max,
                static_cast<long long>(count), kind, pixels.c_str(),
                nameTarget(options, pipeline), where.c_str(),
                result.compileMilliseconds);
  std::string lines = text;
  if (result.isFromCache)
    lines += ", from the cache";
  for (const std::string &image : options.images)
    lines += "\nwrote '" + image + "'";
  return lines;
}
