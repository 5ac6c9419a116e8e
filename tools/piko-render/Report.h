//===- Report.h - What piko-render says of a run ----------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKORENDER_REPORT_H
#define PIKO_TOOLS_PIKORENDER_REPORT_H

#include "Options.h"

#include "Piko/Scene/Binding.h"
#include "Piko/Scene/Json.h"

#include <pikort/pikort.h>

namespace piko::render {

/// Times of frames in milliseconds.
struct FrameTimes {
  double median, min, max, mean;
  int count;
};

struct RunResult {
  FrameTimes times;
  double compileMilliseconds;
  bool isFromCache; ///< so that nothing had to be compiled
  double loadMilliseconds;
  int64_t triangles, vertices, patches;
  int width, height;  ///< of the image, or the domain
  int64_t primitives; ///< of a capture's sources
  int threads;
  int64_t pixels;        ///< that something was drawn to
  std::string imageHash; ///< or, without an image, of all state
  std::vector<Count> counts;
};

/// Whether what kernels take is asked for, and measured by itself.
bool isTimed(const Options &options, pikort_pipeline *pipeline);

/// What kernels take on a device, for each frame, of frames of their own. They
/// change state and statistics of the pipeline.
Result<Json> timeKernels(const Options &options, pikort_pipeline *pipeline);

/// The JSON line, without kernels that are timed by themselves: first what all
/// renderers of the comparison report, then what the runtime counted, for each
/// frame.
Json makeReport(const Options &options, const RunResult &result,
                pikort_pipeline *pipeline);

/// What was drawn, how fast and on what, and where it is, for people.
std::string summarize(const Options &options, const RunResult &result,
                      pikort_pipeline *pipeline);

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_REPORT_H
