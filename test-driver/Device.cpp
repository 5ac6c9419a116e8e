// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Device.cpp - Devices and contexts of the driver for tests ----------===//

#include "State.h"

#include <algorithm>
#include <cstring>
#include <iterator>

using namespace piko::testdriver;
using namespace piko::cuda;

namespace {

struct ErrorName {
  CUresult error;
  const char *name, *text;
};
constexpr ErrorName errorNames[] = {
    {CUDA_SUCCESS, "CUDA_SUCCESS", "no error"},
    {CUDA_ERROR_INVALID_VALUE, "CUDA_ERROR_INVALID_VALUE", "invalid argument"},
    {CUDA_ERROR_OUT_OF_MEMORY, "CUDA_ERROR_OUT_OF_MEMORY", "out of memory"},
    {CUDA_ERROR_NOT_INITIALIZED, "CUDA_ERROR_NOT_INITIALIZED",
     "initialization error"},
    {CUDA_ERROR_DEINITIALIZED, "CUDA_ERROR_DEINITIALIZED",
     "driver shutting down"},
    {CUDA_ERROR_STUB_LIBRARY, "CUDA_ERROR_STUB_LIBRARY",
     "the driver is a stub library"},
    {CUDA_ERROR_DEVICE_UNAVAILABLE, "CUDA_ERROR_DEVICE_UNAVAILABLE",
     "the device cannot run anything now"},
    {CUDA_ERROR_NO_DEVICE, "CUDA_ERROR_NO_DEVICE", "no device is there"},
    {CUDA_ERROR_INVALID_DEVICE, "CUDA_ERROR_INVALID_DEVICE",
     "invalid number of a device"},
    {CUDA_ERROR_INVALID_IMAGE, "CUDA_ERROR_INVALID_IMAGE",
     "the image of a module is not valid"},
    {CUDA_ERROR_INVALID_CONTEXT, "CUDA_ERROR_INVALID_CONTEXT",
     "invalid context"},
    {CUDA_ERROR_NO_BINARY_FOR_GPU, "CUDA_ERROR_NO_BINARY_FOR_GPU",
     "no image of a kernel is for this device"},
    {CUDA_ERROR_INVALID_PTX, "CUDA_ERROR_INVALID_PTX", "invalid PTX"},
    {CUDA_ERROR_UNSUPPORTED_PTX_VERSION, "CUDA_ERROR_UNSUPPORTED_PTX_VERSION",
     "the version of PTX is too new"},
    {CUDA_ERROR_INVALID_HANDLE, "CUDA_ERROR_INVALID_HANDLE",
     "invalid handle of a resource"},
    {CUDA_ERROR_ILLEGAL_STATE, "CUDA_ERROR_ILLEGAL_STATE",
     "a resource is in a state that does not allow the operation"},
    {CUDA_ERROR_NOT_FOUND, "CUDA_ERROR_NOT_FOUND", "named symbol not found"},
    {CUDA_ERROR_NOT_READY, "CUDA_ERROR_NOT_READY", "device not ready"},
    {CUDA_ERROR_ILLEGAL_ADDRESS, "CUDA_ERROR_ILLEGAL_ADDRESS",
     "a kernel accessed memory at an illegal address"},
    {CUDA_ERROR_LAUNCH_OUT_OF_RESOURCES, "CUDA_ERROR_LAUNCH_OUT_OF_RESOURCES",
     "too many resources for a launch"},
    {CUDA_ERROR_LAUNCH_TIMEOUT, "CUDA_ERROR_LAUNCH_TIMEOUT",
     "a kernel did not end in time"},
    {CUDA_ERROR_ASSERT, "CUDA_ERROR_ASSERT", "an assertion of a kernel failed"},
    {CUDA_ERROR_ILLEGAL_INSTRUCTION, "CUDA_ERROR_ILLEGAL_INSTRUCTION",
     "a kernel ran an illegal instruction"},
    {CUDA_ERROR_MISALIGNED_ADDRESS, "CUDA_ERROR_MISALIGNED_ADDRESS",
     "a kernel accessed memory at a misaligned address"},
    {CUDA_ERROR_LAUNCH_FAILED, "CUDA_ERROR_LAUNCH_FAILED", "a kernel failed"},
    {CUDA_ERROR_COOPERATIVE_LAUNCH_TOO_LARGE,
     "CUDA_ERROR_COOPERATIVE_LAUNCH_TOO_LARGE",
     "too many blocks in cooperative launch"},
    {CUDA_ERROR_NOT_SUPPORTED, "CUDA_ERROR_NOT_SUPPORTED",
     "operation not supported"},
    {CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED,
     "CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED",
     "operation not permitted when stream is capturing"},
    {CUDA_ERROR_STREAM_CAPTURE_INVALIDATED,
     "CUDA_ERROR_STREAM_CAPTURE_INVALIDATED",
     "operation failed due to a previous error during capture"},
    {CUDA_ERROR_STREAM_CAPTURE_IMPLICIT, "CUDA_ERROR_STREAM_CAPTURE_IMPLICIT",
     "operation would make the legacy stream depend on a capturing blocking "
     "stream"},
    {CUDA_ERROR_CAPTURED_EVENT, "CUDA_ERROR_CAPTURED_EVENT",
     "operation not permitted on an event last recorded in a capturing stream"},
    {CUDA_ERROR_STREAM_CAPTURE_WRONG_THREAD,
     "CUDA_ERROR_STREAM_CAPTURE_WRONG_THREAD",
     "attempt to terminate a thread-local capture sequence from another "
     "thread"},
    {CUDA_ERROR_GRAPH_EXEC_UPDATE_FAILURE,
     "CUDA_ERROR_GRAPH_EXEC_UPDATE_FAILURE",
     "the graph update was not performed because it included changes which "
     "violated constraints specific to instantiated graph update"},
    {CUDA_ERROR_CONTAINED, "CUDA_ERROR_CONTAINED",
     "an error that is contained in a context"},
    {CUDA_ERROR_TENSOR_MEMORY_LEAK, "CUDA_ERROR_TENSOR_MEMORY_LEAK",
     "tensor memory is not completely freed"},
    {CUDA_ERROR_MPS_CLIENT_TERMINATED, "CUDA_ERROR_MPS_CLIENT_TERMINATED",
     "the MPS client has been ended by its server"},
    {CUDA_ERROR_EXTERNAL_DEVICE, "CUDA_ERROR_EXTERNAL_DEVICE",
     "an error of another device"},
    {CUDA_ERROR_UNKNOWN, "CUDA_ERROR_UNKNOWN", "unknown error"}};

const ErrorName *find(CUresult error) {
  const auto *found =
      std::find_if(std::begin(errorNames), std::end(errorNames),
                   [&](const ErrorName &it) { return it.error == error; });
  return found == std::end(errorNames) ? nullptr : found;
}

/// The primary context of a device; null if there is no such device.
Context *primary(CUdevice device) {
  auto &devices = state().devices;
  return device >= 0 && static_cast<size_t>(device) < devices.size()
             ? devices[static_cast<size_t>(device)].get()
             : nullptr;
}

int attributeOf(CUdevice_attribute attribute) {
  switch (attribute) {
  case CU_DEVICE_ATTRIBUTE_MAX_THREADS_PER_BLOCK:
    return 1024;
  case CU_DEVICE_ATTRIBUTE_MAX_GRID_DIM_X:
    return 0x7fffffff;
  case CU_DEVICE_ATTRIBUTE_MAX_SHARED_MEMORY_PER_BLOCK:
    return 48 << 10;
  case CU_DEVICE_ATTRIBUTE_WARP_SIZE:
    return 32;
  case CU_DEVICE_ATTRIBUTE_MAX_REGISTERS_PER_BLOCK:
    return 65536;
  case CU_DEVICE_ATTRIBUTE_CLOCK_RATE:
    return 1000000;
  case CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT:
    return state().multiprocessors;
  case CU_DEVICE_ATTRIBUTE_MAX_THREADS_PER_MULTIPROCESSOR:
    return 2048;
  case CU_DEVICE_ATTRIBUTE_UNIFIED_ADDRESSING:
  case CU_DEVICE_ATTRIBUTE_MANAGED_MEMORY:
  case CU_DEVICE_ATTRIBUTE_CONCURRENT_MANAGED_ACCESS:
  case CU_DEVICE_ATTRIBUTE_COOPERATIVE_LAUNCH:
    return 1;
  case CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR:
    return state().capability / 10;
  case CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR:
    return state().capability % 10;
  case CU_DEVICE_ATTRIBUTE_PAGEABLE_MEMORY_ACCESS:
    return 0;
  case CU_DEVICE_ATTRIBUTE_MAX_SHARED_MEMORY_PER_BLOCK_OPTIN:
    return 96 << 10;
  }
  return -1;
}

} // namespace

const char *piko::testdriver::nameOf(CUresult error) {
  const ErrorName *it = find(error);
  return it ? it->name : nullptr;
}

const char *piko::testdriver::textOf(CUresult error) {
  const ErrorName *it = find(error);
  return it ? it->text : nullptr;
}

CUresult piko::cuda::cuInit(unsigned flags) {
  Call call(__func__, Needs::Nothing);
  if (CUresult error = call.refused())
    return error;
  if (flags)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "flags that are not 0");
  if (state().devices.empty())
    return call.fail(CUDA_ERROR_NO_DEVICE, "");
  state().initialized = true;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuDriverGetVersion(int *version) {
  Call call(__func__, Needs::Nothing);
  if (CUresult error = call.refused())
    return error;
  if (!version)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  *version = 12090;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuGetErrorName(CUresult error, const char **text) {
  *text = nameOf(error);
  return *text ? CUDA_SUCCESS : CUDA_ERROR_INVALID_VALUE;
}

CUresult piko::cuda::cuGetErrorString(CUresult error, const char **text) {
  *text = textOf(error);
  return *text ? CUDA_SUCCESS : CUDA_ERROR_INVALID_VALUE;
}

CUresult piko::cuda::cuDeviceGetCount(int *count) {
  Call call(__func__, Needs::Initialization);
  if (CUresult error = call.refused())
    return error;
  if (!count)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  *count = static_cast<int>(state().devices.size());
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuDeviceGet(CUdevice *device, int ordinal) {
  Call call(__func__, Needs::Initialization);
  if (CUresult error = call.refused())
    return error;
  if (!primary(ordinal))
    return call.fail(CUDA_ERROR_INVALID_DEVICE, std::to_string(ordinal));
  *device = ordinal;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuDeviceGetName(char *name, int size, CUdevice device) {
  Call call(__func__, Needs::Initialization);
  if (CUresult error = call.refused())
    return error;
  if (!primary(device))
    return call.fail(CUDA_ERROR_INVALID_DEVICE, std::to_string(device));
  if (!name || size <= 0)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no room for a name");
  const char *text = "Piko test device";
  auto room = static_cast<size_t>(size) - 1;
  size_t length = std::min(std::strlen(text), room);
  std::memcpy(name, text, length);
  name[length] = 0;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuDeviceGetAttribute(int *value,
                                          CUdevice_attribute attribute,
                                          CUdevice device) {
  Call call(__func__, Needs::Initialization);
  if (CUresult error = call.refused())
    return error;
  if (!primary(device))
    return call.fail(CUDA_ERROR_INVALID_DEVICE, std::to_string(device));
  int found = attributeOf(attribute);
  if (!value || found < 0)
    return call.fail(CUDA_ERROR_INVALID_VALUE,
                     "attribute " + std::to_string(attribute));
  *value = found;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuDeviceTotalMem(size_t *bytes, CUdevice device) {
  Call call(__func__, Needs::Initialization);
  if (CUresult error = call.refused())
    return error;
  if (!primary(device))
    return call.fail(CUDA_ERROR_INVALID_DEVICE, std::to_string(device));
  *bytes = state().memoryLimit;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuDevicePrimaryCtxRetain(CUcontext *context,
                                              CUdevice device) {
  Call call(__func__, Needs::Initialization);
  if (CUresult error = call.refused())
    return error;
  Context *found = primary(device);
  if (!found)
    return call.fail(CUDA_ERROR_INVALID_DEVICE, std::to_string(device));
  if (!found->references++)
    found->handle = state().newHandle<CUcontext>();
  *context = found->handle;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuDevicePrimaryCtxRelease(CUdevice device) {
  Call call(__func__, Needs::Initialization);
  if (CUresult error = call.refused())
    return error;
  Context *found = primary(device);
  if (!found)
    return call.fail(CUDA_ERROR_INVALID_DEVICE, std::to_string(device));
  if (!found->references)
    return call.fail(CUDA_ERROR_INVALID_CONTEXT, "released too often");
  if (--found->references)
    return CUDA_SUCCESS;
  // Nothing could be freed any more after a kernel has failed.
  if (!found->failed)
    state().leaks += found->describe();
  state().devices[static_cast<size_t>(device)] = std::make_unique<Context>();
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuDevicePrimaryCtxReset(CUdevice device) {
  Call call(__func__, Needs::Initialization);
  if (CUresult error = call.refused())
    return error;
  Context *found = primary(device);
  if (!found)
    return call.fail(CUDA_ERROR_INVALID_DEVICE, std::to_string(device));
  // The same handle, so that who goes on with what was there is found out.
  auto fresh = std::make_unique<Context>();
  fresh->references = found->references;
  fresh->handle = found->handle;
  if (!found->failed)
    state().leaks += found->describe();
  state().devices[static_cast<size_t>(device)] = std::move(fresh);
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuCtxSetCurrent(CUcontext context) {
  Call call(__func__, Needs::Initialization);
  if (CUresult error = call.refused())
    return error;
  if (context && !contextOf(context))
    return call.fail(CUDA_ERROR_INVALID_CONTEXT, "no live context");
  currentContext() = context;
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuCtxGetCurrent(CUcontext *context) {
  Call call(__func__, Needs::Initialization);
  if (CUresult error = call.refused())
    return error;
  *context = currentContext();
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuCtxSynchronize() {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (CUresult error =
          call.refuseCaptures(CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED,
                              [](const Stream &) { return true; }))
    return error;
  ++state().hostCounts.waits;
  return call.finishAll();
}
