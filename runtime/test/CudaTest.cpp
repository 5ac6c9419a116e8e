// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaTest.cpp - The runtime's part for CUDA, on the driver for tests ===//

#include "TestDriver.h"
#include "cuda/DriverAPI.h"
#include "pikort/grid.h"
#include "pikort/pikort.hpp"

#include <cstdlib>
#include <gtest/gtest.h>
#include <numeric>
#include <string>
#include <vector>

using namespace piko::cuda;

namespace {

// out[i] = items[i] * factor, for the positions of a block's units.
const char *const goodPTX = R"(
.version 6.0
.target sm_70
.address_size 64

.visible .entry scale(
  .param .u64 input,
  .param .u64 out,
  .param .u64 factor
)
.maxntid 32, 1, 1
{
  .reg .pred %p<3>;
  .reg .b32 %r<7>;
  .reg .b64 %rd<18>;

  ld.param.u64 %rd14, [input];
  ld.param.u64 %rd3, [out];
  ld.param.u64 %rd4, [factor];
  ld.global.u64 %rd2, [%rd14];
  ld.global.u64 %rd1, [%rd14+32];
  ld.global.u64 %rd15, [%rd14+40];
  mov.u32 %r1, %ctaid.x;
  cvt.u64.u32 %rd16, %r1;
  mov.u32 %r6, %nctaid.x;
  cvt.u64.u32 %rd17, %r6;
unit:
  setp.ge.s64 %p2, %rd16, %rd15;
  @%p2 bra done;
  mul.lo.s64 %rd5, %rd16, 40;
  add.s64 %rd16, %rd16, %rd17;
  add.s64 %rd6, %rd1, %rd5;
  ld.global.u64 %rd7, [%rd6+16];
  ld.global.u64 %rd8, [%rd6+24];
  ld.global.u32 %r2, [%rd4];
  mov.u32 %r3, %tid.x;
  cvt.u64.u32 %rd9, %r3;
  add.s64 %rd10, %rd7, %rd9;
next:
  setp.ge.s64 %p1, %rd10, %rd8;
  @%p1 bra unit;
  shl.b64 %rd11, %rd10, 2;
  add.s64 %rd12, %rd2, %rd11;
  ld.global.u32 %r4, [%rd12];
  mul.lo.s32 %r5, %r4, %r2;
  add.s64 %rd13, %rd3, %rd11;
  st.global.u32 [%rd13], %r5;
  add.s64 %rd10, %rd10, 32;
  bra next;
done:
  ret;
}
)";
const char *const wrongPTX = ".version 6.0\n.target sm_70\n"
                             ".address_size 64\nmultiply everything;\n";

/// What the program brings along and launches.
const char *ptx = goodPTX, *kernel = "scale";
bool strayPointer = false;

void setup(pikort_pipeline *p) {
  pikoir_cuda_module(p, ptx);
  pikoir_declare_pipeline(p, "Scale", 1);
  pikoir_declare_record(p, 0, "int", 4, 4);
  pikoir_declare_field(p, 0, "value", PIKORT_I32, 0, 1, 0);
  pikoir_declare_state(p, 0, "factor", PIKORT_CONSTANT, 0, 0, -1, nullptr);
  pikoir_declare_state(p, 1, "out", PIKORT_BUFFER, 0, 1, -1, nullptr);
  pikoir_declare_written(p, 1);
  int64_t bins[] = {0};
  pikoir_declare_stage(p, 0, "scale", 0, bins, PIKOIR_LOAD_BALANCE, 0,
                       PIKOIR_SPLIT, 1);
  pikoir_declare_source(p, 0, 0);
}

int32_t run(pikort_pipeline *p) {
  const pikoir_input *in = pikoir_begin(p, 0);
  if (!in)
    return pikoir_status(p);
  int64_t blocks = pikoir_blocks(p, 0, 0, 32);
  pikoir_log *log = pikoir_log_open(p, 0, 0);
  int32_t local[64] = {};
  const void *arguments[] = {in,
                             strayPointer ? reinterpret_cast<uint8_t *>(local)
                                          : pikoir_get_state(p, 1)->data,
                             pikoir_get_state(p, 0)->data};
  pikoir_cuda_launch(p, kernel, blocks, 32, arguments, 3);
  pikoir_log_close(p, log);
  return pikoir_end(p, 0);
}

const pikort_program program{PIKORT_ABI_VERSION, "Scale", setup, run};

class Cuda : public testing::Test {
protected:
  static void SetUpTestSuite() {
    setenv("PIKO_CUDA_DRIVER", PIKO_TEST_DRIVER, 1);
  }
  void SetUp() override {
    ptx = goodPTX;
    kernel = "scale";
    strayPointer = false;
    std::iota(numbers.begin(), numbers.end(), 0);
    pikoTestDriverReset();
  }
  void TearDown() override {
    EXPECT_STREQ(pikoTestDriverAlive(), "");
    EXPECT_STREQ(pikoTestDriverLeaks(), "");
    unsetenv("PIKO_CUDA_DEVICE");
  }

  /// Creates, binds and runs; the first error, or how it ended. `out` is what
  /// was written.
  piko::rt::Status scale(int runs = 1) {
    piko::rt::Pipeline pipe{program};
    if (auto status = pipe.created(); !status)
      return status;
    int32_t factor = 3;
    std::fill(out.begin(), out.end(), -1);
    for (const auto &status :
         {pipe.domain({8}), pipe.constant("factor", factor),
          pipe.buffer("out", std::span(out)), pipe.source(0, numbers)})
      if (!status)
        return status;
    for (int i = 0; i < runs; ++i)
      if (auto status = pipe.run(); !status)
        return status;
    return piko::rt::Status();
  }
  void expectScaled() {
    for (size_t i = 0; i < out.size(); ++i)
      ASSERT_EQ(out[i], 3 * static_cast<int32_t>(i));
  }

  std::vector<int32_t> numbers = std::vector<int32_t>(5000);
  std::vector<int32_t> out = std::vector<int32_t>(5000);
};

// First: later ones have a driver that has started.
TEST_F(Cuda, DriverThatDoesNotStart) {
  setenv("PIKO_CUDA_DRIVER", "/no/such/driver.so", 1);
  auto status = scale();
  EXPECT_EQ(status.code(), PIKORT_NO_DEVICE);
  EXPECT_NE(status.message().find("no CUDA device: cannot load the driver: "
                                  "/no/such/driver.so"),
            std::string::npos)
      << status.message();
  setenv("PIKO_CUDA_DRIVER", PIKO_TEST_DRIVER, 1);
  pikoTestDriverFail("cuInit", 1, CUDA_ERROR_NO_DEVICE);
  status = scale();
  EXPECT_EQ(status.code(), PIKORT_NO_DEVICE);
  EXPECT_NE(status.message().find("the driver does not start"),
            std::string::npos)
      << status.message();
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

TEST_F(Cuda, AllocatesNothingInLaterRuns) {
  piko::rt::Pipeline pipe{program};
  int32_t factor = 3;
  ASSERT_TRUE(pipe.domain({8}));
  ASSERT_TRUE(pipe.constant("factor", factor));
  ASSERT_TRUE(pipe.buffer("out", std::span(out)));
  ASSERT_TRUE(pipe.source(0, numbers));
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
  EXPECT_NE(status.message().find("PIKO_CUDA_DEVICE: expected a number from 0 "
                                  "to 0, but got '7'"),
            std::string::npos)
      << status.message();
  setenv("PIKO_CUDA_DEVICE", "first", 1);
  EXPECT_EQ(scale().code(), PIKORT_NO_DEVICE);
}

TEST_F(Cuda, WrongKernels) {
  ptx = wrongPTX;
  auto status = scale();
  EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
  for (const char *part : {"CUDA device 0", "loading the kernels (", "line 4",
                           "CUDA_ERROR_INVALID_PTX"})
    EXPECT_NE(status.message().find(part), std::string::npos)
        << status.message();
  ptx = goodPTX;
  kernel = "other";
  status = scale();
  EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
  EXPECT_NE(
      status.message().find("finding kernel 'other': CUDA_ERROR_NOT_FOUND"),
      std::string::npos)
      << status.message();
}

TEST_F(Cuda, AccessOutsideOfSharedMemory) {
  strayPointer = true;
  auto status = scale();
  EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
  EXPECT_NE(status.message().find(
                "running kernel 'scale': CUDA_ERROR_ILLEGAL_ADDRESS"),
            std::string::npos)
      << status.message();
  // The context is gone, and what was in it; the next one is new.
  pikoTestDriverReset();
  strayPointer = false;
  ASSERT_TRUE(scale());
  expectScaled();
}

TEST_F(Cuda, MemoryThatRunsOut) {
  pikoTestDriverFail("cuMemAllocManaged", 1, CUDA_ERROR_OUT_OF_MEMORY);
  auto status = scale();
  EXPECT_EQ(status.code(), PIKORT_OUT_OF_MEMORY) << status.message();
  ASSERT_TRUE(scale());
  expectScaled();
}

/// Whether the call that failed gives something back, which is lost then.
bool wasRelease(const std::string &error) {
  for (const char *name : {"cuMemFree", "cuModuleUnload", "cuStreamDestroy",
                           "cuDevicePrimaryCtxRelease"})
    if (error.rfind(name, 0) == 0)
      return true;
  return false;
}

TEST_F(Cuda, EachCallFails) {
  ASSERT_TRUE(scale()); // starts the driver
  pikoTestDriverReset();
  ASSERT_TRUE(scale(2));
  uint64_t calls = pikoTestDriverCalls(nullptr);
  ASSERT_GT(calls, 20u);
  int failed = 0;
  for (uint64_t n = 1; n <= calls; ++n) {
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
    if (wasRelease(error)) // nobody can give it back now
      pikoTestDriverReset();
    else
      EXPECT_STREQ(pikoTestDriverAlive(), "") << error;
    ASSERT_TRUE(scale()) << "after " << error;
    expectScaled();
  }
  EXPECT_GT(failed, 10);
}

} // namespace
