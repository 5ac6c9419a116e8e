// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- StreamCalls.cpp - Streams and events of the driver for tests -------===//

#include "State.h"

using namespace piko::testdriver;
using namespace piko::cuda;

CUresult piko::cuda::cuStreamCreate(CUstream *stream, unsigned flags) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!stream || flags > CU_STREAM_NON_BLOCKING)
    return call.fail(CUDA_ERROR_INVALID_VALUE,
                     "flags " + std::to_string(flags));
  *stream = state().newHandle<CUstream>();
  call.context().streams[*stream].flags = flags;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuStreamDestroy(CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (call.context().streams.contains(stream))
    call.finish(call.context().laterOf(stream));
  const Capture *capture = call.context().captureOf(stream);
  if (capture && capture->isOwner)
    call.context().destroyGraph(capture->graph);
  if (!call.context().streams.erase(stream))
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no live stream");
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuStreamSynchronize(CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  return call.waitFor(stream);
}

CUresult piko::cuda::cuStreamGetCtx(CUstream stream, CUcontext *context) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!context)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  *context = nullptr;
  if (isDefault(stream))
    *context = currentContext();
  for (const auto &device : state().devices)
    if (device->streams.contains(stream))
      *context = device->handle;
  return *context ? CUDA_SUCCESS
                  : call.fail(CUDA_ERROR_INVALID_HANDLE, "no live stream");
}

CUresult piko::cuda::cuEventCreate(CUevent *event, unsigned flags) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!event || (flags & ~CU_EVENT_DISABLE_TIMING))
    return call.fail(CUDA_ERROR_INVALID_VALUE,
                     "flags " + std::to_string(flags));
  *event = state().newHandle<CUevent>();
  call.context().events[*event].isTimed = !(flags & CU_EVENT_DISABLE_TIMING);
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuEventDestroy(CUevent event) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!call.context().events.erase(event))
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no live event");
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuEventRecord(CUevent event, CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto found = call.context().events.find(event);
  if (found == call.context().events.end())
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no live event");
  if (CUresult error = call.checkStream(stream))
    return error;
  Event &recorded = found->second;
  recorded.recorded = true;
  recorded.captured = call.context().captureOf(stream) ? stream : CUstream();
  recorded.time = std::chrono::steady_clock::now();
  recorded.waiting = nullptr;
  const uint64_t number = ++recorded.records;
  if (state().delays && !recorded.captured) {
    recorded.waiting = &call.context().laterOf(stream);
    recorded.waiting->push_back([event, number](const Call &at) {
      auto it = at.context().events.find(event);
      if (it == at.context().events.end() || it->second.records != number)
        return;
      it->second.waiting = nullptr;
      it->second.time = std::chrono::steady_clock::now();
    });
  }
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuEventQuery(CUevent event) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto found = call.context().events.find(event);
  if (found == call.context().events.end())
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no live event");
  if (found->second.captured)
    return call.fail(CUDA_ERROR_CAPTURED_EVENT, "");
  return found->second.waiting ? CUDA_ERROR_NOT_READY : CUDA_SUCCESS;
}

CUresult piko::cuda::cuEventSynchronize(CUevent event) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto found = call.context().events.find(event);
  if (found == call.context().events.end())
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no live event");
  if (found->second.captured) {
    if (Capture *capture = call.context().captureOf(found->second.captured))
      capture->valid = false;
    return call.fail(CUDA_ERROR_CAPTURED_EVENT, "");
  }
  ++state().hostCounts.waits;
  const Event &until = found->second;
  return until.waiting ? call.finish(*until.waiting, &until) : CUDA_SUCCESS;
}

CUresult piko::cuda::cuEventElapsedTime(float *milliseconds, CUevent start,
                                        CUevent end) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  const auto &events = call.context().events;
  auto first = events.find(start), last = events.find(end);
  if (first == events.end() || last == events.end() ||
      !first->second.recorded || !last->second.recorded ||
      !first->second.isTimed || !last->second.isTimed)
    return call.fail(CUDA_ERROR_INVALID_HANDLE,
                     "no event with a time that was recorded");
  if (first->second.waiting || last->second.waiting)
    return CUDA_ERROR_NOT_READY;
  if (first->second.captured || last->second.captured)
    return call.fail(CUDA_ERROR_CAPTURED_EVENT, "");
  if (!milliseconds)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  *milliseconds = std::chrono::duration<float, std::milli>(last->second.time -
                                                           first->second.time)
                      .count();
  return CUDA_SUCCESS;
}
