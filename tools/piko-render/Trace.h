// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which thread ran which bins when, in the trace event format of Chrome, which
// Perfetto shows, too:
// https://docs.google.com/document/d/1CvAClvFfyA5R-PhYUmn5OOQtYMH4h6I0nSsKchNAySU

#ifndef PIKO_TOOLS_PIKORENDER_TRACE_H
#define PIKO_TOOLS_PIKORENDER_TRACE_H

#include "Piko/Scene/Result.h"
#include "pikort/pikort.h"

#include <string>

namespace piko::render {

/// Runs a frame and writes an event for each unit of work to `path`.
Result<Done> traceFrame(pikort_pipeline *pipeline, const std::string &path);

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_TRACE_H
