// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- MemoryCalls.cpp - Memory of the driver for tests -------------------===//

#include "State.h"

#include <cstring>

using namespace piko::testdriver;
using namespace piko::cuda;

namespace {

CUresult allocate(Call &call, AllocationKind kind, uint64_t *address,
                  uint64_t bytes) {
  if (!address || !bytes)
    return call.fail(CUDA_ERROR_INVALID_VALUE, address ? "no bytes" : "null");
  MemoryTable &memory = call.context().memory;
  if (kind == AllocationKind::Device &&
      bytes > state().memoryLimit - memory.deviceBytes())
    return call.fail(CUDA_ERROR_OUT_OF_MEMORY,
                     std::to_string(bytes) + " bytes, and " +
                         std::to_string(memory.deviceBytes()) + " of " +
                         std::to_string(state().memoryLimit) + " are taken");
  const Allocation *made = memory.allocate(kind, bytes);
  if (!made)
    return call.fail(CUDA_ERROR_OUT_OF_MEMORY,
                     std::to_string(bytes) + " bytes");
  *address = made->begin;
  return CUDA_SUCCESS;
}

CUresult release(Call &call, uint64_t address, bool isHost) {
  if (CUresult error = call.finishAll())
    return error;
  MemoryTable &memory = call.context().memory;
  const Allocation *it = memory.at(address);
  if (!it || it->begin != address || it->kind == AllocationKind::Module ||
      (it->kind == AllocationKind::Host) != isHost) {
    std::string known = memory.describe(address);
    return call.fail(CUDA_ERROR_INVALID_VALUE,
                     "no allocation begins at the address" +
                         (known.empty() ? "" : ", " + known));
  }
  memory.release(address);
  return CUDA_SUCCESS;
}

} // namespace

CUresult piko::cuda::cuMemGetInfo(size_t *free, size_t *total) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!free || !total)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  *total = state().memoryLimit;
  *free = state().memoryLimit - call.context().memory.deviceBytes();
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuMemAlloc(CUdeviceptr *address, size_t bytes) {
  Call call(__func__, Needs::NoCapture);
  if (CUresult error = call.refused())
    return error;
  return allocate(call, AllocationKind::Device, address, bytes);
}

CUresult piko::cuda::cuMemAllocManaged(CUdeviceptr *address, size_t bytes,
                                       unsigned flags) {
  Call call(__func__, Needs::NoCapture);
  if (CUresult error = call.refused())
    return error;
  if (flags != CU_MEM_ATTACH_GLOBAL)
    return call.fail(CUDA_ERROR_INVALID_VALUE,
                     "flags " + std::to_string(flags));
  return allocate(call, AllocationKind::Managed, address, bytes);
}

CUresult piko::cuda::cuMemFree(CUdeviceptr address) {
  Call call(__func__, Needs::NoCapture);
  if (CUresult error = call.refused())
    return error;
  return address ? release(call, address, false) : CUDA_SUCCESS;
}

CUresult piko::cuda::cuMemAllocHost(void **address, size_t bytes) {
  Call call(__func__, Needs::NoCapture);
  if (CUresult error = call.refused())
    return error;
  uint64_t made = 0;
  CUresult result =
      allocate(call, AllocationKind::Host, address ? &made : nullptr, bytes);
  if (!result)
    *address = reinterpret_cast<void *>(made);
  return result;
}

CUresult piko::cuda::cuMemFreeHost(void *address) {
  Call call(__func__, Needs::NoCapture);
  if (CUresult error = call.refused())
    return error;
  return release(call, reinterpret_cast<uint64_t>(address), true);
}

/// Of an allocation of any device, or of none.
static uint64_t attributeOf(CUpointer_attribute which, const Context *context,
                            size_t device, const Allocation *it) {
  switch (which) {
  case CU_POINTER_ATTRIBUTE_CONTEXT:
    return it ? reinterpret_cast<uint64_t>(context->handle) : 0;
  case CU_POINTER_ATTRIBUTE_MEMORY_TYPE:
    return !it                                ? 0
           : it->kind == AllocationKind::Host ? CU_MEMORYTYPE_HOST
                                              : CU_MEMORYTYPE_DEVICE;
  case CU_POINTER_ATTRIBUTE_IS_MANAGED:
    return it && it->kind == AllocationKind::Managed;
  case CU_POINTER_ATTRIBUTE_DEVICE_ORDINAL:
    return it ? device : uint32_t(CU_DEVICE_INVALID);
  case CU_POINTER_ATTRIBUTE_RANGE_START_ADDR:
    return it ? it->begin : 0;
  case CU_POINTER_ATTRIBUTE_RANGE_SIZE:
    return it ? it->bytes : 0;
  }
  return 0;
}

/// Of what the driver writes.
static size_t sizeOf(CUpointer_attribute which) {
  switch (which) {
  case CU_POINTER_ATTRIBUTE_MEMORY_TYPE:
  case CU_POINTER_ATTRIBUTE_DEVICE_ORDINAL:
    return 4;
  case CU_POINTER_ATTRIBUTE_IS_MANAGED:
    return 1;
  default:
    return 8;
  }
}

CUresult piko::cuda::cuPointerGetAttributes(unsigned count,
                                            CUpointer_attribute *attributes,
                                            void **values,
                                            CUdeviceptr address) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!attributes || !values)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  const Context *context = nullptr;
  const Allocation *found = nullptr;
  size_t device = 0;
  for (size_t d = 0; d < state().devices.size() && !found; ++d) {
    context = state().devices[d].get();
    found = context->memory.at(address);
    device = d;
  }
  for (unsigned i = 0; i < count; ++i) {
    uint64_t value = attributeOf(attributes[i], context, device, found);
    std::memcpy(values[i], &value, sizeOf(attributes[i]));
  }
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuMemPrefetchAsync(CUdeviceptr address, size_t bytes,
                                        CUdevice device, CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (CUresult error = call.checkStream(stream))
    return error;
  if (Capture *capture = call.context().captureOf(stream)) {
    capture->valid = false;
    return call.fail(CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED, "");
  }
  std::string wrong =
      bytes ? checkMemory(call.context(), address, bytes) : "no bytes";
  if (!wrong.empty())
    return call.fail(CUDA_ERROR_INVALID_VALUE, wrong);
  if (call.context().memory.at(address)->kind != AllocationKind::Managed)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "memory is not managed");
  if (device != CU_DEVICE_CPU &&
      (device < 0 || static_cast<size_t>(device) >= state().devices.size()))
    return call.fail(CUDA_ERROR_INVALID_DEVICE, std::to_string(device));
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuMemcpyAsync(CUdeviceptr to, CUdeviceptr from,
                                   size_t bytes, CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  return bytes
             ? submit(call, stream, Copy{Direction::OnDevice, to, from, bytes})
             : call.checkStream(stream);
}

CUresult piko::cuda::cuMemcpyHtoDAsync(CUdeviceptr to, const void *from,
                                       size_t bytes, CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  return bytes ? submit(call, stream,
                        Copy{Direction::ToDevice, to,
                             reinterpret_cast<uint64_t>(from), bytes})
               : call.checkStream(stream);
}

CUresult piko::cuda::cuMemcpyDtoHAsync(void *to, CUdeviceptr from, size_t bytes,
                                       CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  return bytes ? submit(call, stream,
                        Copy{Direction::FromDevice,
                             reinterpret_cast<uint64_t>(to), from, bytes})
               : call.checkStream(stream);
}

CUresult piko::cuda::cuMemsetD8Async(CUdeviceptr address, unsigned char value,
                                     size_t bytes, CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  return bytes ? submit(call, stream, Fill{address, bytes, value})
               : call.checkStream(stream);
}
