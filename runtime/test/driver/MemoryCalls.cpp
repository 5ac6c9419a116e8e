// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- MemoryCalls.cpp - Memory of the driver for tests -------------------===//

#include "State.h"

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
