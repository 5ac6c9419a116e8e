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

/// Where a part of the device's memory is in the host; null, with the call's
/// text, if it is not all in one allocation.
uint8_t *resolve(const Call &call, CUdeviceptr address, uint64_t bytes,
                 CUstream stream) {
  if (!call.hasStream(stream)) {
    call.fail(CUDA_ERROR_INVALID_HANDLE, "no live stream");
    return nullptr;
  }
  const MemoryTable &memory = call.context().memory;
  const Allocation *it = memory.at(address);
  if (!it || bytes > it->begin + it->bytes - address) {
    std::string known = memory.describe(address);
    call.fail(CUDA_ERROR_INVALID_VALUE,
              std::to_string(bytes) + " bytes are not all in an allocation" +
                  (known.empty() ? "" : ", " + known));
    return nullptr;
  }
  return it->memory + (address - it->begin);
}

CUresult errorOf(const Call &call, CUstream stream) {
  return call.hasStream(stream) ? CUDA_ERROR_INVALID_VALUE
                                : CUDA_ERROR_INVALID_HANDLE;
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
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  return allocate(call, AllocationKind::Device, address, bytes);
}

CUresult piko::cuda::cuMemAllocManaged(CUdeviceptr *address, size_t bytes,
                                       unsigned flags) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (flags != CU_MEM_ATTACH_GLOBAL)
    return call.fail(CUDA_ERROR_INVALID_VALUE,
                     "flags " + std::to_string(flags));
  return allocate(call, AllocationKind::Managed, address, bytes);
}

CUresult piko::cuda::cuMemFree(CUdeviceptr address) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  return address ? release(call, address, false) : CUDA_SUCCESS;
}

CUresult piko::cuda::cuMemAllocHost(void **address, size_t bytes) {
  Call call(__func__, Needs::Context);
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
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  return release(call, reinterpret_cast<uint64_t>(address), true);
}

CUresult piko::cuda::cuMemPrefetchAsync(CUdeviceptr address, size_t bytes,
                                        CUdevice device, CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!bytes || !resolve(call, address, bytes, stream))
    return errorOf(call, stream);
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
  if (!bytes)
    return CUDA_SUCCESS;
  uint8_t *target = resolve(call, to, bytes, stream);
  const uint8_t *source = target ? resolve(call, from, bytes, stream) : nullptr;
  if (!source)
    return errorOf(call, stream);
  std::memmove(target, source, bytes);
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuMemcpyHtoDAsync(CUdeviceptr to, const void *from,
                                       size_t bytes, CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!bytes)
    return CUDA_SUCCESS;
  uint8_t *target = resolve(call, to, bytes, stream);
  if (!target || !from)
    return errorOf(call, stream);
  std::memmove(target, from, bytes);
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuMemcpyDtoHAsync(void *to, CUdeviceptr from, size_t bytes,
                                       CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!bytes)
    return CUDA_SUCCESS;
  const uint8_t *source = resolve(call, from, bytes, stream);
  if (!source || !to)
    return errorOf(call, stream);
  std::memmove(to, source, bytes);
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuMemsetD8Async(CUdeviceptr address, unsigned char value,
                                     size_t bytes, CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!bytes)
    return CUDA_SUCCESS;
  uint8_t *target = resolve(call, address, bytes, stream);
  if (!target)
    return errorOf(call, stream);
  std::memset(target, value, bytes);
  return CUDA_SUCCESS;
}
