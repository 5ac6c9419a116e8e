// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaTest.cpp - The runtime's part for CUDA, on the driver for tests ===//

#include "Symbols.h"
#include "cuda/CudaFixture.h"

#include <cstdlib>

using namespace piko::cuda;

namespace {

// First: later ones have a driver that has started.
TEST_F(Cuda, DriverThatDoesNotStart) {
  setenv("PIKO_CUDA_DRIVER", "/no/such/driver.so", 1);
  auto status = scale();
  EXPECT_EQ(status.code(), PIKORT_NO_DEVICE);
  expectIn(status, {"no CUDA device: cannot load the driver: "
                    "/no/such/driver.so"});
  setenv("PIKO_CUDA_DRIVER", PIKO_TEST_DRIVER, 1);
  pikoTestDriverFail("cuInit", 1, CUDA_ERROR_NO_DEVICE);
  status = scale();
  EXPECT_EQ(status.code(), PIKORT_NO_DEVICE);
  expectIn(status, {"the driver does not start"});
  ASSERT_TRUE(scale());
  expectScaled();
}

TEST_F(Cuda, RunsAgainAndAgain) {
  ASSERT_TRUE(scale(5));
  expectScaled();
  PikoTestDriverCounts counts;
  ASSERT_EQ(pikoTestDriverCounts("scale", &counts), 0);
  EXPECT_EQ(counts.launches, 5u);
}

TEST_F(Cuda, AFrameIsOneSubmission) {
  ASSERT_TRUE(scale(3));
  expectScaled();
  PikoTestDriverHostCounts counts;
  pikoTestDriverHostCounts(&counts);
  EXPECT_EQ(counts.graphLaunches, 3u);
  EXPECT_EQ(counts.graphKernels, 6u); // a join and the kernel
  EXPECT_EQ(counts.launches, 0u);
  // Two arrays to it and one back, what both say, and the constant.
  EXPECT_EQ(counts.copies, 3 * 5 + 1);
  EXPECT_EQ(counts.fills, 0u);
  EXPECT_EQ(counts.waits, 6u); // for its end, and for what comes back
  EXPECT_EQ(pikoTestDriverCalls("cuGraphInstantiateWithFlags"), 1u);
  EXPECT_EQ(pikoTestDriverCalls("cuStreamBeginCapture"), 1u);
  EXPECT_EQ(pikoTestDriverCalls("cuMemAllocManaged"), 0u);
}

// Those that find no room would be a second wave. 5,000 items are 79 blocks' at
// most.
TEST_F(Cuda, AsManyBlocksAsAreResident) {
  PikoTestDriverCounts counts;
  ASSERT_TRUE(scale());
  ASSERT_EQ(pikoTestDriverCounts("scale", &counts), 0);
  EXPECT_EQ(counts.blocks, 79u);
  pikoTestDriverReset();
  std::string large = goodPTX;
  large.insert(large.find("  .reg .pred"),
               "  .shared .align 4 .b8 room[40960];\n");
  bring(large.c_str());
  ASSERT_TRUE(scale());
  expectScaled();
  ASSERT_EQ(pikoTestDriverCounts("scale", &counts), 0);
  EXPECT_EQ(counts.blocks, 4u * 5u); // of four multiprocessors of 228 KB
}

// Of a frame that is one submission nothing is known, unless it is asked for.
TEST_F(Cuda, TimesOfKernels) {
  piko::rt::Pipeline pipe{program};
  ASSERT_TRUE(bind(pipe));
  auto stats = [&] {
    pikort_kernel_stats stats{};
    EXPECT_EQ(pikort_get_kernel_stats(pipe.get(), 0, &stats), PIKORT_OK);
    return stats;
  };
  ASSERT_TRUE(pipe.run());
  EXPECT_EQ(stats().launches, 0);
  EXPECT_EQ(stats().milliseconds, 0);
  pikort_time_stats time;
  ASSERT_EQ(pikort_get_time_stats(pipe.get(), &time), PIKORT_OK);
  EXPECT_GT(time.device, 0);
  ASSERT_EQ(pikort_set_kernel_times(pipe.get(), 1), PIKORT_OK);
  for (bool late : {false, true}) {
    pikoTestDriverDelay(late);
    double before = stats().milliseconds;
    ASSERT_TRUE(pipe.run());
    EXPECT_GT(stats().milliseconds, before);
  }
  EXPECT_STREQ(stats().name, "scaler");
  EXPECT_EQ(stats().launches, 2);
  EXPECT_GT(stats().join_milliseconds, 0);
  EXPECT_LT(stats().join_milliseconds, stats().milliseconds);
  expectScaled();
  ASSERT_EQ(pikort_set_kernel_times(pipe.get(), 0), PIKORT_OK);
  ASSERT_TRUE(pipe.run());
  EXPECT_EQ(stats().launches, 2);
  pikort_reset_stats(pipe.get());
  EXPECT_EQ(stats().milliseconds, 0);
}

TEST_F(Cuda, AllocatesNothingInLaterRuns) {
  piko::rt::Pipeline pipe{program};
  ASSERT_TRUE(bind(pipe));
  ASSERT_TRUE(pipe.run());
  uint64_t before = pikoTestDriverCalls("cuMemAllocManaged");
  for (int i = 0; i < 3; ++i)
    ASSERT_TRUE(pipe.run());
  EXPECT_EQ(pikoTestDriverCalls("cuMemAllocManaged"), before);
}

TEST_F(Cuda, DeviceThatIsNotThere) {
  setenv("PIKO_CUDA_DEVICE", "7", 1);
  auto status = scale();
  EXPECT_EQ(status.code(), PIKORT_NO_DEVICE);
  expectIn(status, {"PIKO_CUDA_DEVICE: expected a number from 0 "
                    "to 1, but got '7'"});
  setenv("PIKO_CUDA_DEVICE", "first", 1);
  EXPECT_EQ(scale().code(), PIKORT_NO_DEVICE);
}

TEST_F(Cuda, WrongKernels) {
  bring(wrongPTX);
  auto status = scale();
  EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
  expectIn(status, {"CUDA device 0", "loading the kernels (", "line 4",
                    "CUDA_ERROR_INVALID_PTX"});
  bring(goodPTX);
  kernel = "other";
  status = scale();
  EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
  expectIn(status, {"finding kernel 'other': CUDA_ERROR_NOT_FOUND"});
}

// The device is of 9.0.
TEST_F(Cuda, CubinsThatFitComeFirst) {
  ASSERT_TRUE(scale());
  uint64_t before = pikoTestDriverCalls("cuModuleLoadDataEx");
  bring(goodPTX, {{80, 0, nullptr},
                  {86, 0, nullptr},
                  {90, 1, nullptr},
                  {100, 0, nullptr},
                  {92, 0, nullptr},
                  {91, 1, nullptr}});
  ASSERT_TRUE(scale(2));
  expectScaled();
  EXPECT_EQ(pikoTestDriverCalls("cuModuleLoadDataEx"), 2 * before + 1);
}

TEST_F(Cuda, PipelinesShareTheRuntimesKernels) {
  piko::rt::Pipeline first{program};
  ASSERT_TRUE(bind(first));
  ASSERT_TRUE(first.run());
  uint64_t before = pikoTestDriverCalls("cuModuleLoadDataEx");
  for (int i = 0; i < 3; ++i) {
    piko::rt::Pipeline other{program};
    ASSERT_TRUE(bind(other));
    ASSERT_TRUE(other.run());
    expectScaled();
  }
  EXPECT_EQ(pikoTestDriverCalls("cuModuleLoadDataEx"), before + 3);
  ASSERT_TRUE(first.run());
  expectScaled();
}

TEST_F(Cuda, CubinsThatAreRefused) {
  bring(wrongPTX, {{90, 0, nullptr}, {90, 1, nullptr}});
  auto status = scale();
  EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
  expectIn(status,
           {"line 4", "; the cubin for 90: CUDA_ERROR_NO_BINARY_FOR_GPU"});
  EXPECT_EQ(pikoTestDriverCalls("cuModuleLoadDataEx"), 3u);
  // Whatever is wrong with it, there is the PTX.
  for (CUresult error : {CUDA_ERROR_INVALID_IMAGE, CUDA_ERROR_UNKNOWN}) {
    bring(goodPTX, {{90, 0, nullptr}});
    pikoTestDriverFail("cuModuleLoadDataEx", 1, error);
    ASSERT_TRUE(scale());
    expectScaled();
  }
  pikoTestDriverFail("cuModuleLoadDataEx", 1, CUDA_ERROR_OUT_OF_MEMORY);
  EXPECT_EQ(scale().code(), PIKORT_OUT_OF_MEMORY);
  images.erase(images.begin() + 1); // the PTX
  status = scale();
  EXPECT_EQ(status.code(), PIKORT_BAD_PROGRAM);
  expectIn(status, {"expected PTX"});
}

TEST_F(Cuda, AccessOutsideOfSharedMemory) {
  strayPointer = true;
  auto status = scale();
  EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
  expectIn(status, {"running kernel 'scale' of stage 'scaler' "
                    "(scale.cpp:7): CUDA_ERROR_ILLEGAL_ADDRESS"});
  // The context is gone, and what was in it; the next one is new.
  pikoTestDriverReset();
  strayPointer = false;
  ASSERT_TRUE(scale());
  expectScaled();
}

TEST_F(Cuda, MemoryThatRunsOut) {
  for (const char *call : {"cuMemAlloc", "cuMemAllocHost"}) {
    pikoTestDriverFail(call, 1, CUDA_ERROR_OUT_OF_MEMORY);
    auto status = scale();
    EXPECT_EQ(status.code(), PIKORT_OUT_OF_MEMORY) << call;
    ASSERT_TRUE(scale());
    expectScaled();
  }
}

/// Whether the call that failed gives something back, which is lost then.
bool wasRelease(const std::string &error) {
  for (const char *name : {"cuMemFree", "cuModuleUnload", "cuStreamDestroy"})
    if (error.rfind(name, 0) == 0)
      return true;
  return false;
}

// Each third one, unless all tests are asked for.
TEST_F(Cuda, EachCallFails) {
  ASSERT_TRUE(scale()); // starts the driver
  pikoTestDriverReset();
  ASSERT_TRUE(scale(2));
  uint64_t calls = pikoTestDriverCalls(nullptr);
  ASSERT_GT(calls, 20u);
  int failed = 0;
  uint64_t nextCall = std::getenv("PIKO_TEST_ALL") ? 1 : 3;
  for (uint64_t n = 1; n <= calls; n += nextCall) {
    cuCtxSetCurrent(nullptr); // which a call before may have failed to do
    pikoTestDriverReset();
    pikoTestDriverFail(nullptr, n, CUDA_ERROR_UNKNOWN);
    auto status = scale(2);
    std::string error = pikoTestDriverError();
    ASSERT_FALSE(error.empty()) << "call " << n;
    if (status) {
      expectScaled(); // it was not needed
    } else {
      ++failed;
      EXPECT_NE(status.message().find("CUDA"), std::string::npos)
          << error << " gives " << status.message();
    }
    if (error.rfind("cuDevicePrimaryCtxRelease", 0) == 0)
      EXPECT_EQ(cuDevicePrimaryCtxRelease(0), CUDA_SUCCESS);
    else if (wasRelease(error)) // nobody can give it back now
      pikoTestDriverReset();
    else
      EXPECT_STREQ(pikoTestDriverAlive(), "") << error;
    auto next = scale();
    ASSERT_TRUE(next) << next.message() << " after " << error << ", call " << n;
    expectScaled();
  }
  EXPECT_GT(failed, 10);
}

} // namespace
