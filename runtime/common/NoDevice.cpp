// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- NoDevice.cpp - A runtime without CUDA ------------------------------===//
//
// What stands for devices in a build without GPUs (PIKO_ENABLE_GPU): there is
// none.
//
//===----------------------------------------------------------------------===//

#include "common/HostCalls.h"

using namespace piko::rt;

DeviceScope::DeviceScope() noexcept = default;
DeviceScope::~DeviceScope() = default;

bool piko::rt::isDeviceKind(std::string_view name) noexcept {
  return name == "cuda";
}

void piko::rt::checkDevice(std::string_view kind, int32_t) {
  throw Failure{PIKORT_NO_DEVICE,
                "expected a runtime that was built with PIKO_ENABLE_GPU, which "
                "has " +
                    std::string(kind)};
}

int32_t pikort_device_count() { return 0; }

int32_t pikort_get_device(int32_t, pikort_device_info *info) {
  if (!info)
    return PIKORT_INVALID_ARGUMENT;
  *info = {};
  return PIKORT_NOT_FOUND;
}
