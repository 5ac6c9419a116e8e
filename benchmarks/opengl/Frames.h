//===- Frames.h - How long frames take --------------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_BENCHMARKS_OPENGL_FRAMES_H
#define PIKO_BENCHMARKS_OPENGL_FRAMES_H

#include "Drawing.h"

namespace piko::peer {

struct FrameOptions {
  int warmup = 5, frames = 30;
  double seconds = 1000; ///< after which it ends, with 3 timed frames at least
};

/// In milliseconds.
struct Times {
  double median, least, most;
};

struct FrameTimes {
  Times device; ///< by queries of GL_TIME_ELAPSED
  Times wall;   ///< from the first call until glFinish returns
  int count;
};

/// Draws frames, each of which is waited for, as those of a pipeline are.
/// `isSoftware`: there is no device, and its times are the wall clock's, since
/// llvmpipe's queries do not see when it rasterizes.
Result<FrameTimes> timeFrames(const GL &gl, const Drawing &drawing,
                              bool isSoftware, const FrameOptions &options);

} // namespace piko::peer

#endif // PIKO_BENCHMARKS_OPENGL_FRAMES_H
