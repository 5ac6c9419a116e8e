// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Device.h - The CUDA driver and one of its devices ------------------===//
//
// The driver is loaded when it is first asked for, from libcuda.so.1 or from
// where the environment variable PIKO_CUDA_DRIVER says. PIKO_CUDA_DEVICE is the
// number of the device that pipelines use, 0 if it is not set.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_H
#define PIKO_RUNTIME_CUDA_DEVICE_H

#include "cuda/DriverAPI.h"

#include <memory>
#include <string>

namespace piko::cuda {

/// The driver's functions; throws Failure with PIKORT_NO_DEVICE.
const Driver &loadDriver();

/// A device and its primary context, shared by all pipelines of the process.
class Device {
public:
  /// The device that the environment chooses; throws Failure.
  static std::shared_ptr<Device> open();

  Device(const Driver &driver, int ordinal);
  Device(const Device &) = delete;
  Device &operator=(const Device &) = delete;
  ~Device();

  const Driver &driver;
  const int ordinal;

  int attribute(CUdevice_attribute which) const;
  /// Makes its context the calling thread's; the result of the call.
  CUresult enter() const { return driver.cuCtxSetCurrent(context_); }
  /// Throws Failure unless `result` is success; `doing` is what was tried.
  void check(CUresult result, const std::string &doing) const;
  /// "CUDA device 0 (name): doing: CUDA_ERROR_...: what that means".
  std::string describe(CUresult result, const std::string &doing) const;

private:
  CUdevice device_ = 0;
  CUcontext context_ = nullptr;
  std::string name_;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_H
