// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- DriverFixture.h - Kernels in tests of the driver for tests ---------===//

#ifndef PIKO_TEST_DRIVER_DRIVERFIXTURE_H
#define PIKO_TEST_DRIVER_DRIVERFIXTURE_H

#include "Symbols.h"
#include "TestDriver.h"

#include <cstring>
#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace piko::testdriver {

using namespace piko::cuda;

/// A context of device 0, current, for each test. Leaks fail the test.
class DriverTest : public testing::Test {
protected:
  void SetUp() override;
  void TearDown() override;

  /// A kernel `k` of \p body with registers of every type, and parameters
  /// [in] and [out] in %rd1 and %rd2; %r1 is the thread, %rd3 and %rd4 point at
  /// its 64 bits of both. \p before goes before the kernel.
  static std::string kernel(const std::string &body,
                            const std::string &before = "");
  /// Loads a module; the test's last. Fails the test with the error's text.
  CUfunction load(const std::string &source, const char *name = "k");
  /// A function of that module that a capture may launch: in mode `lazy` its
  /// handle alone is not enough.
  CUfunction loadForCapture(const char *name);
  /// What loading says; empty if it works.
  std::string loadError(const std::string &source);
  /// Unloads what `load` has loaded.
  void unload();
  /// Runs a kernel of `kernel`; [out] has a number of each thread, [in] has
  /// \p in, and zeros after it up to as many.
  std::vector<uint64_t> run(const std::string &body,
                            std::vector<uint64_t> in = {},
                            unsigned threads = 32, unsigned blocks = 1,
                            const std::string &before = "");
  /// Launches; the error that synchronization then gives.
  CUresult launch(CUfunction function, unsigned blocks, unsigned threads,
                  std::vector<uint64_t> parameters);
  /// The same, of a cooperative launch.
  CUresult launchTogether(CUfunction function, unsigned blocks,
                          unsigned threads, std::vector<uint64_t> parameters);
  /// Releases the context, which a failed kernel has made useless, and makes a
  /// new one.
  void renewContext();

  CUmodule module = nullptr;
  bool expectsLeaks = false;
};

} // namespace piko::testdriver

#endif // PIKO_TEST_DRIVER_DRIVERFIXTURE_H
