// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Pointers.cpp - What the host hands to a device ---------------------===//
//
// The driver says where memory lies and what a stream is of, so that what is
// wrong is an error of a call and not of a kernel, after which a device is
// lost.
//
//===----------------------------------------------------------------------===//

#include "common/Pipeline.h"
#include "cuda/Device.h"

#include <cstdio>

using namespace piko::cuda;
using piko::rt::Failure;

namespace {

/// Of an allocation; zeros where the driver knows none.
struct Allocation {
  uint64_t context, type, isManaged, device, begin, size;

  bool isHosts() const { return type != CU_MEMORYTYPE_DEVICE; }
};

} // namespace

/// The allocation that an address lies in.
static Allocation find(const Device &device, CUdeviceptr address) {
  Allocation found{};
  CUpointer_attribute which[] = {CU_POINTER_ATTRIBUTE_CONTEXT,
                                 CU_POINTER_ATTRIBUTE_MEMORY_TYPE,
                                 CU_POINTER_ATTRIBUTE_IS_MANAGED,
                                 CU_POINTER_ATTRIBUTE_DEVICE_ORDINAL,
                                 CU_POINTER_ATTRIBUTE_RANGE_START_ADDR,
                                 CU_POINTER_ATTRIBUTE_RANGE_SIZE};
  void *values[] = {&found.context, &found.type,  &found.isManaged,
                    &found.device,  &found.begin, &found.size};
  device.check(device.enter(), "entering its context");
  device.check(device.driver.cuPointerGetAttributes(6, which, values, address),
               "asking where memory lies");
  return found;
}

static std::string hex(CUdeviceptr address) {
  char text[32];
  std::snprintf(text, sizeof(text), "0x%llx",
                static_cast<unsigned long long>(address));
  return text;
}

void Device::checkMemory(const std::string &who, CUdeviceptr address,
                         int64_t bytes) const {
  auto fail = [&](const std::string &got) {
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  who + ": expected memory of " + describe() + ", but " + got};
  };
  CUdeviceptr end = address + static_cast<CUdeviceptr>(bytes);
  // What is mapped piece by piece has several allocations.
  for (CUdeviceptr at = address; at < end;) {
    Allocation found = find(*this, at);
    if (at != address && found.isHosts())
      fail(std::to_string(end - at) + " of " + std::to_string(bytes) +
           " bytes from " + hex(address) + " on lie after the allocation");
    if (found.isHosts())
      fail(hex(address) + " is memory of the host");
    if (!found.isManaged && static_cast<int>(found.device) != ordinal)
      fail(hex(address) + " is memory of device " +
           std::to_string(static_cast<int>(found.device)));
    // Of a pool it has none.
    if (!found.isManaged && found.context &&
        reinterpret_cast<CUcontext>(found.context) != context_)
      fail(hex(address) + " is memory of a context that is not the device's "
                          "primary one");
    CUdeviceptr next = found.begin + found.size;
    if (next <= at) // the driver does not know
      return;
    at = next;
  }
}

void Device::checkHosts(const std::string &who, const void *data) const {
  auto address = reinterpret_cast<CUdeviceptr>(data);
  Allocation found = find(*this, address);
  if (!found.isHosts() && !found.isManaged)
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  who + ": expected memory of the host, but " + hex(address) +
                      " is memory of a device, which is bound as such "
                      "(piko::rt::DeviceSpan)"};
}

void Device::checkStream(CUstream stream) const {
  CUstreamCaptureStatus status = CU_STREAM_CAPTURE_STATUS_NONE;
  CUcontext context = nullptr;
  check(enter(), "entering its context");
  check(driver.cuStreamGetCtx(stream, &context), "looking at the stream");
  if (context != context_)
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  "expected a stream of the primary context of " + describe() +
                      ", but got one of another context or device"};
  check(driver.cuStreamIsCapturing(stream, &status), "looking at the stream");
  if (status != CU_STREAM_CAPTURE_STATUS_NONE)
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  "expected a stream that runs what it is given, but it is "
                  "captured; a run cannot be a part of a graph"};
}
