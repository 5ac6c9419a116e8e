// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaFixture.h - A program for the driver for tests -----------------===//

#ifndef PIKO_TEST_CUDAFIXTURE_H
#define PIKO_TEST_CUDAFIXTURE_H

#include "TestDriver.h"
#include "cuda/DriverAPI.h"
#include "pikort/grid.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace piko::cuda {

/// What a program brings along and launches: out[i] = items[i] * factor.
struct ScaleProgram {
  static const char *const goodPTX, *const wrongPTX;

  /// The same, but the device says that there are errors, which the host does
  /// not find.
  static std::string failingPTX();
  static std::vector<pikoir_cuda_image> images;
  static const char *kernel;
  static bool strayPointer; ///< Items lie where no device sees them.

  /// Cubins of chips, for none of which the driver for tests has a device, and
  /// PTX.
  static void bring(const char *ptx,
                    std::vector<pikoir_cuda_image> cubins = {});
  static void writeArguments(pikort_pipeline *p, const pikoir_input *input,
                             pikoir_log *log, int64_t *words);
  /// What a device does by itself.
  static void declareSteps(pikort_pipeline *p);
  static const pikort_program program;
};

/// What a host has of CUDA: the primary context of a device, current until the
/// end of the object.
class HostContext {
public:
  explicit HostContext(int32_t device = 0);
  HostContext(const HostContext &) = delete;
  HostContext &operator=(const HostContext &) = delete;
  ~HostContext();

  const int32_t device;
  CUcontext handle = nullptr;
};

/// Numbers in memory of the current context.
class DeviceNumbers {
public:
  explicit DeviceNumbers(const std::vector<int32_t> &values);
  DeviceNumbers(const DeviceNumbers &) = delete;
  DeviceNumbers &operator=(const DeviceNumbers &) = delete;
  ~DeviceNumbers();

  std::vector<int32_t> get() const;
  rt::DeviceSpan<int32_t> span() const { return {address, count}; }

  CUdeviceptr address = 0;
  const size_t count;
};

/// On a machine with two devices of compute capability 9.0.
class Cuda : public testing::Test, protected ScaleProgram {
protected:
  static void SetUpTestSuite();
  void SetUp() override;
  /// Nothing is left on a device.
  void TearDown() override;

  /// Binds what a pipeline needs; the first error.
  piko::rt::Status bind(piko::rt::Pipeline &pipe);
  /// Creates, binds and runs; the first error, or how it ended. `out` is what
  /// was written.
  piko::rt::Status scale(int runs = 1, piko::rt::Device device = {});
  void expectScaled() const { expectScaled(out); }
  static void expectScaled(const std::vector<int32_t> &values,
                           int32_t factor = 3);
  static PikoTestDriverHostCounts hostCounts();
  static void expectIn(const piko::rt::Status &status,
                       std::initializer_list<const char *> parts);

  std::vector<int32_t> numbers = std::vector<int32_t>(5000);
  std::vector<int32_t> out = std::vector<int32_t>(5000);
};

} // namespace piko::cuda

#endif // PIKO_TEST_CUDAFIXTURE_H
