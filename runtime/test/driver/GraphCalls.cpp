// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- GraphCalls.cpp - Captures and graphs of the driver for tests -------===//

#include "State.h"

#include <algorithm>
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
  if (!stream)
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
  return CUDA_SUCCESS;
}

// --- Captures ----------------------------------------------------------------

CUresult piko::cuda::cuStreamBeginCapture(CUstream stream,
                                          CUstreamCaptureMode mode) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
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
  return CUDA_SUCCESS;
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
  if (!capture.valid)
    return call.fail(CUDA_ERROR_STREAM_CAPTURE_INVALIDATED, "");
  *graph = state().newHandle<CUgraph>();
  call.context().graphs[*graph] = capture.nodes;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuStreamIsCapturing(CUstream stream,
                                         CUstreamCaptureStatus *status) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!status)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  if (stream && !call.context().streams.contains(stream))
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no live stream");
  const Capture *capture = call.context().captureOf(stream);
  *status = !capture         ? CU_STREAM_CAPTURE_STATUS_NONE
            : capture->valid ? CU_STREAM_CAPTURE_STATUS_ACTIVE
                             : CU_STREAM_CAPTURE_STATUS_INVALIDATED;
  return CUDA_SUCCESS;
}

// --- Graphs ------------------------------------------------------------------

namespace {

/// What makes an executable node none that can be updated to another.
CUgraphExecUpdateResult difference(const Work &from, const Work &to) {
  if (from.index() != to.index())
    return CU_GRAPH_EXEC_UPDATE_ERROR_NODE_TYPE_CHANGED;
  if (const auto *kernel = std::get_if<Kernel>(&from)) {
    const auto &other = std::get<Kernel>(to);
    if (kernel->function != other.function)
      return CU_GRAPH_EXEC_UPDATE_ERROR_FUNCTION_CHANGED;
    if (kernel->cooperative != other.cooperative)
      return CU_GRAPH_EXEC_UPDATE_ERROR_ATTRIBUTES_CHANGED;
  }
  if (const auto *copy = std::get_if<Copy>(&from))
    if (copy->direction != std::get<Copy>(to).direction)
      return CU_GRAPH_EXEC_UPDATE_ERROR_PARAMETERS_CHANGED;
  return CU_GRAPH_EXEC_UPDATE_SUCCESS;
}

CUgraphExecUpdateResultInfo compare(const Nodes &from, const Nodes &to) {
  if (from.size() != to.size())
    return {CU_GRAPH_EXEC_UPDATE_ERROR_TOPOLOGY_CHANGED, nullptr, nullptr};
  for (size_t i = 0; i < from.size(); ++i)
    if (auto result = difference(from[i].work, to[i].work))
      return {result, to[i].handle, nullptr};
  return {CU_GRAPH_EXEC_UPDATE_SUCCESS, nullptr, nullptr};
}

const char *textOf(CUgraphExecUpdateResult result) {
  switch (result) {
  case CU_GRAPH_EXEC_UPDATE_ERROR_TOPOLOGY_CHANGED:
    return "another number of nodes";
  case CU_GRAPH_EXEC_UPDATE_ERROR_NODE_TYPE_CHANGED:
    return "another type of a node";
  case CU_GRAPH_EXEC_UPDATE_ERROR_FUNCTION_CHANGED:
    return "another function of a kernel";
  case CU_GRAPH_EXEC_UPDATE_ERROR_ATTRIBUTES_CHANGED:
    return "a kernel that is cooperative, and one that is not";
  default:
    return "another direction of a copy";
  }
}

/// Runs a node; false ends the graph.
bool runNode(const Call &call, const Work &work) {
  Context &context = call.context();
  if (const auto *kernel = std::get_if<Kernel>(&work)) {
    if (!context.functions.contains(kernel->function)) {
      context.failed =
          call.fail(CUDA_ERROR_LAUNCH_FAILED, "a kernel that was unloaded");
      return false;
    }
    ++state().hostCounts.graphKernels;
  }
  if (std::string wrong = checkMemory(context, work); !wrong.empty()) {
    context.failed = call.fail(CUDA_ERROR_ILLEGAL_ADDRESS, wrong);
    return false;
  }
  run(call, work);
  return context.failed == CUDA_SUCCESS;
}

} // namespace

CUresult piko::cuda::cuGraphInstantiateWithFlags(CUgraphExec *executable,
                                                 CUgraph graph,
                                                 unsigned long long flags) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto found = call.context().graphs.find(graph);
  if (!executable || flags)
    return call.fail(CUDA_ERROR_INVALID_VALUE,
                     "flags " + std::to_string(flags));
  if (found == call.context().graphs.end())
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live graph");
  *executable = state().newHandle<CUgraphExec>();
  call.context().executables[*executable] = found->second;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuGraphExecUpdate(CUgraphExec executable, CUgraph graph,
                                       CUgraphExecUpdateResultInfo *info) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto from = call.context().executables.find(executable);
  auto to = call.context().graphs.find(graph);
  if (!info || from == call.context().executables.end() ||
      to == call.context().graphs.end())
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live graph");
  *info = compare(from->second, to->second);
  if (info->result)
    return call.fail(CUDA_ERROR_GRAPH_EXEC_UPDATE_FAILURE,
                     textOf(info->result));
  from->second = to->second;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuGraphLaunch(CUgraphExec executable, CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto found = call.context().executables.find(executable);
  if (found == call.context().executables.end())
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live executable graph");
  if (CUresult error = call.checkStream(stream))
    return error;
  if (call.context().captureOf(stream))
    return call.fail(CUDA_ERROR_NOT_SUPPORTED, "a graph within a graph");
  ++state().hostCounts.graphLaunches;
  for (const Node &node : found->second)
    if (!runNode(call, node.work))
      break;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuGraphExecDestroy(CUgraphExec executable) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!call.context().executables.erase(executable))
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live executable graph");
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuGraphDestroy(CUgraph graph) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!call.context().graphs.erase(graph))
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live graph");
  return CUDA_SUCCESS;
}
