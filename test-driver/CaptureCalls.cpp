// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CaptureCalls.cpp - Captures of the driver for tests ----------------===//

#include "State.h"

#include <utility>

using namespace piko::testdriver;
using namespace piko::cuda;

Capture *Context::captureOf(CUstream stream) {
  auto found = streams.find(stream);
  return found != streams.end() && found->second.capture
             ? &*found->second.capture
             : nullptr;
}

CUresult Call::checkStream(CUstream stream) const {
  if (isDefault(stream))
    return refuseCaptures(
        CUDA_ERROR_STREAM_CAPTURE_IMPLICIT,
        [](const Stream &it) { return !(it.flags & CU_STREAM_NON_BLOCKING); });
  if (!current->streams.contains(stream))
    return fail(CUDA_ERROR_INVALID_HANDLE, "no live stream");
  const Capture *capture = current->captureOf(stream);
  return capture && !capture->valid
             ? fail(CUDA_ERROR_STREAM_CAPTURE_INVALIDATED, "")
             : CUDA_SUCCESS;
}

CUresult Call::waitFor(CUstream stream) const {
  if (CUresult error = checkStream(stream))
    return error;
  if (Capture *capture = current->captureOf(stream)) {
    capture->valid = false;
    return fail(CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED,
                "the stream is captured");
  }
  ++state().hostCounts.waits;
  return finish(current->laterOf(stream));
}

Later &Context::laterOf(CUstream stream) {
  auto found = streams.find(stream);
  return found != streams.end() && found->second.flags & CU_STREAM_NON_BLOCKING
             ? found->second.later
             : later;
}

CUresult Call::finish(Later &later, const Event *upTo) const {
  while (!later.empty() && (!upTo || upTo->waiting)) {
    auto next = std::move(later.front());
    later.pop_front();
    if (!current->failed)
      next(*this);
  }
  return current->failed;
}

CUresult Call::finishAll() const {
  for (auto &[handle, stream] : current->streams)
    finish(stream.later);
  return finish(current->later);
}

/// Begins to capture into a graph, or into a new one if it is null.
static CUresult beginCapture(const Call &call, CUstream stream, CUgraph graph,
                             CUgraphNode last, CUstreamCaptureMode mode) {
  if (!stream)
    return call.fail(CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED,
                     "the legacy stream");
  if (mode < CU_STREAM_CAPTURE_MODE_GLOBAL ||
      mode > CU_STREAM_CAPTURE_MODE_RELAXED)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "mode " + std::to_string(mode));
  if (CUresult error = call.checkStream(stream))
    return error;
  std::optional<Capture> &capture = call.context().streams[stream].capture;
  if (capture)
    return call.fail(CUDA_ERROR_ILLEGAL_STATE, "it is captured already");
  capture.emplace();
  capture->mode = mode;
  capture->thread = std::this_thread::get_id();
  capture->isOwner = !graph;
  capture->graph = graph ? graph : state().newHandle<CUgraph>();
  capture->last = last;
  call.context().graphs[capture->graph];
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuStreamBeginCapture(CUstream stream,
                                          CUstreamCaptureMode mode) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  return beginCapture(call, stream, nullptr, nullptr, mode);
}

CUresult piko::cuda::cuStreamBeginCaptureToGraph(
    CUstream stream, CUgraph graph, const CUgraphNode *dependencies,
    const CUgraphEdgeData *edges, size_t count, CUstreamCaptureMode mode) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!call.context().graphs.contains(graph) || (count && !dependencies))
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live graph");
  if (edges || count > 1)
    return call.fail(CUDA_ERROR_NOT_SUPPORTED,
                     "nodes that do not follow each other");
  return beginCapture(call, stream, graph, count ? *dependencies : nullptr,
                      mode);
}

CUresult piko::cuda::cuStreamEndCapture(CUstream stream, CUgraph *graph) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!graph)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  *graph = nullptr;
  auto &streams = call.context().streams;
  auto found = streams.find(stream);
  if (stream && found == streams.end())
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no live stream");
  if (!stream || !found->second.capture)
    return call.fail(CUDA_ERROR_ILLEGAL_STATE, "it is not captured");
  if (found->second.capture->mode != CU_STREAM_CAPTURE_MODE_RELAXED &&
      found->second.capture->thread != std::this_thread::get_id())
    return call.fail(CUDA_ERROR_STREAM_CAPTURE_WRONG_THREAD, "");
  const Capture capture =
      *std::exchange(found->second.capture, std::optional<Capture>());
  if (!capture.valid) {
    if (capture.isOwner)
      call.context().destroyGraph(capture.graph);
    return call.fail(CUDA_ERROR_STREAM_CAPTURE_INVALIDATED, "");
  }
  *graph = capture.graph;
  return CUDA_SUCCESS;
}

static CUstreamCaptureStatus statusOf(const Capture *capture) {
  return !capture         ? CU_STREAM_CAPTURE_STATUS_NONE
         : capture->valid ? CU_STREAM_CAPTURE_STATUS_ACTIVE
                          : CU_STREAM_CAPTURE_STATUS_INVALIDATED;
}

CUresult piko::cuda::cuStreamIsCapturing(CUstream stream,
                                         CUstreamCaptureStatus *status) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!status)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  if (!isDefault(stream) && !call.context().streams.contains(stream))
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no live stream");
  *status = statusOf(call.context().captureOf(stream));
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuStreamGetCaptureInfo(CUstream stream,
                                            CUstreamCaptureStatus *status,
                                            uint64_t *id, CUgraph *graph,
                                            const CUgraphNode **dependencies,
                                            size_t *count) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!status)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  if (stream && !call.context().streams.contains(stream))
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no live stream");
  const Capture *capture = call.context().captureOf(stream);
  *status = statusOf(capture);
  if (*status != CU_STREAM_CAPTURE_STATUS_ACTIVE)
    return CUDA_SUCCESS;
  if (id)
    *id = reinterpret_cast<uint64_t>(capture->graph);
  if (graph)
    *graph = capture->graph;
  if (dependencies)
    *dependencies = &capture->last;
  if (count)
    *count = capture->last ? 1 : 0;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuStreamUpdateCaptureDependencies(
    CUstream stream, CUgraphNode *dependencies, size_t count, unsigned flags) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (CUresult error = call.checkStream(stream))
    return error;
  Capture *capture = call.context().captureOf(stream);
  if (!capture)
    return call.fail(CUDA_ERROR_ILLEGAL_STATE, "it is not captured");
  if (flags != CU_STREAM_SET_CAPTURE_DEPENDENCIES || count != 1)
    return call.fail(CUDA_ERROR_NOT_SUPPORTED,
                     "nodes that do not follow each other");
  if (!dependencies)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  capture->last = *dependencies;
  return CUDA_SUCCESS;
}
