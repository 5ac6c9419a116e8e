// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Device.h - The CUDA driver and one of its devices ------------------===//
//
// The driver is loaded when it is first asked for, from libcuda.so.1 or from
// where the environment variable PIKO_CUDA_DRIVER says. PIKO_CUDA_DEVICE is the
// number of the device for pipelines whose host chooses none, 0 if it is not
// set.
//
// An error of a kernel, or of the hardware, is that of all later calls of its
// context: the device is lost for the pipelines that are on it, which touch
// neither it nor its memory again. The next pipeline resets it.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_H
#define PIKO_RUNTIME_CUDA_DEVICE_H

#include "cuda/DriverAPI.h"

#include <atomic>
#include <memory>
#include <mutex>
#include <string>

namespace piko::cuda {

/// The driver's functions; throws Failure with PIKORT_NO_DEVICE.
const Driver &loadDriver();

/// How a device was lost, if it was.
struct Loss {
  std::atomic<CUresult> result = CUDA_SUCCESS;
  std::mutex mutex;
  std::string text; ///< What happened first.
};

class OwnKernels;

/// A device and its primary context, shared by all pipelines of the process
/// that are on it.
class Device {
public:
  /// The device of a number, or the one that the environment chooses
  /// (PIKORT_ANY_DEVICE); throws Failure.
  static std::shared_ptr<Device> open(int32_t number);

  /// `loss` is kept up to date, for who opens it next; with `reset` what was
  /// in its context goes.
  Device(const Driver &driver, int ordinal, std::shared_ptr<Loss> loss,
         bool reset);
  Device(const Device &) = delete;
  Device &operator=(const Device &) = delete;
  ~Device();

  const Driver &driver;
  const int ordinal;

  int attribute(CUdevice_attribute which) const;
  CUcontext context() const { return context_; }
  /// Of compute, 10 * major + minor.
  int capability() const {
    return 10 * attribute(CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR) +
           attribute(CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR);
  }
  /// Makes its context the calling thread's, until the end of the host's call
  /// (rt::DeviceScope); the result of the driver's, or what the device was lost
  /// by.
  CUresult enter() const;
  /// Throws Failure unless `result` is success; `doing` is what was tried.
  void check(CUresult result, const std::string &doing) const;
  bool isLost() const { return loss_->result != CUDA_SUCCESS; }
  /// Throws Failure if it is lost, with what happened.
  void checkAlive() const;
  /// Throws Failure unless its kernels may use so many bytes there; `who`
  /// begins the message.
  void checkMemory(const std::string &who, CUdeviceptr address,
                   int64_t bytes) const;
  /// Throws Failure if the host has no access to what it says is its own.
  void checkHosts(const std::string &who, const void *data) const;
  /// Throws Failure unless work may be given to a stream of the host's.
  void checkStream(CUstream stream) const;
  /// Those of the runtime, as its pipelines share them.
  OwnKernels &ownKernels() const { return *ownKernels_; }
  /// "CUDA device 0 (name)"
  std::string describe() const;

private:
  void noteLoss(CUresult result, const std::string &what) const;

  std::shared_ptr<Loss> loss_;
  CUdevice device_ = 0;
  CUcontext context_ = nullptr;
  std::string name_;
  std::unique_ptr<OwnKernels> ownKernels_;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_H
