// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaStripsTest.cpp - Strips that a device repeats ------------------===//

#include "cuda/CudaFixture.h"

#include <algorithm>
#include <cstring>

using namespace piko::cuda;
using piko::rt::Pipeline;
using piko::rt::Status;

namespace {

/// Scales strip by strip; a strip's numbers go where the source has them.
class CudaStrips : public Cuda {
protected:
  void SetUp() override {
    Cuda::SetUp();
    ptx_ = goodPTX;
    replace("add.s64 %rd13, %rd3, %rd11;", "add.s64 %rd13, %rd3, %rd12;");
    bring(ptx_.c_str());
  }
  /// The kernel says that there are errors where it finds a number.
  void failAt(int32_t number) {
    replace("ld.global.u32 %r4, [%rd12];",
            "ld.global.u32 %r4, [%rd12];\n  setp.eq.s32 %p1, %r4, " +
                std::to_string(number) +
                ";\n  ld.param.u64 %rd13, [log];\n  mov.u64 %rd11, 1;\n"
                "  @%p1 st.global.u64 [%rd13+32], %rd11;");
    bring(ptx_.c_str());
  }
  Status scaleStrips(int64_t size, int runs = 1) {
    Pipeline pipe{program};
    if (auto status = pipe.created(); !status)
      return status;
    std::fill(out.begin(), out.end(), -1);
    Status status = bind(pipe);
    if (status)
      status = pipe.stripSize(size);
    for (int i = 0; i < runs && status; ++i)
      status = pipe.run();
    peak_ = pikort_peak_bytes(pipe.get());
    return status;
  }
  static uint64_t launchCalls() {
    return pikoTestDriverCalls("cuLaunchKernel") +
           pikoTestDriverCalls("cuLaunchCooperativeKernel");
  }
  static uint64_t launchesOf(const char *kernel) {
    PikoTestDriverCounts counts;
    pikoTestDriverCounts(kernel, &counts);
    return counts.launches;
  }

  int64_t peak_ = 0; ///< Of the latest pipeline, in bytes.

private:
  void replace(const std::string &what, const std::string &by) {
    size_t at = ptx_.find(what);
    ASSERT_NE(at, std::string::npos);
    ptx_.replace(at, what.size(), by);
  }
  static void setup(pikort_pipeline *p) {
    ScaleProgram::program.setup(p);
    int32_t stages[] = {0};
    pikoir_declare_strips(p, 0, 0, 0, stages, 1);
    static pikoir_cuda_grid grids[2];
    grids[0] = {kernel, 32, 4, writeArguments};
    static const pikoir_cuda_step steps[] = {
        {PIKOIR_STEP_STRIPS, 0, -1, -1, nullptr, nullptr},
        {PIKOIR_STEP_STAGE, 0, -1, -1, grids, nullptr},
        {PIKOIR_STEP_END_STRIPS, 0, -1, -1, nullptr, nullptr}};
    pikoir_cuda_program(p, steps, 3);
  }
  static void writeArguments(pikort_pipeline *p, const pikoir_input *input,
                             pikoir_log *log, int64_t *words) {
    static int32_t local[64];
    int64_t count = 0;
    auto *source =
        static_cast<const uint8_t *>(pikoir_get_source(p, 0, &count));
    auto *to = strayPointer ? reinterpret_cast<uint8_t *>(local)
                            : pikoir_get_state(p, 1)->data;
    const void *arguments[] = {input,
                               reinterpret_cast<const void *>(to - source),
                               pikoir_get_state(p, 0)->data, log};
    std::memcpy(words, arguments, sizeof(arguments));
  }
  static int32_t run(pikort_pipeline *p) {
    while (pikoir_strips_next(p, 0)) {
      const pikoir_input *in = pikoir_begin(p, 0);
      if (!in)
        continue;
      int64_t blocks = pikoir_blocks(p, 0, 0, 32);
      pikoir_log *log = pikoir_log_open(p, 0, 0);
      int64_t arguments[4];
      writeArguments(p, in, log, arguments);
      pikoir_cuda_launch(p, kernel, blocks, 32, arguments, 4);
      pikoir_log_close(p, log);
      pikoir_end(p, 0);
    }
    return pikoir_status(p);
  }

protected:
  static constexpr pikort_program program{PIKORT_ABI_VERSION, "Strips", setup,
                                          run};

private:
  std::string ptx_;
};

TEST_F(CudaStrips, HundredsAreOneSubmission) {
  ASSERT_TRUE(scaleStrips(2500)); // two
  expectScaled();
  EXPECT_EQ(launchesOf("scale"), 2u);
  uint64_t few = launchCalls();
  int64_t peak = peak_;
  pikoTestDriverReset();
  ASSERT_TRUE(scaleStrips(7));
  expectScaled();
  EXPECT_EQ(launchesOf("scale"), 715u);
  EXPECT_EQ(hostCounts().graphLaunches, 1u);
  EXPECT_EQ(hostCounts().launches, 0u);
  EXPECT_EQ(launchCalls(), few); // of a graph that does not say how many
  EXPECT_LT(peak_, peak);        // they take memory again
}

TEST_F(CudaStrips, OfAnySize) {
  for (size_t count : {5000, 4, 1, 0}) {
    numbers.resize(count);
    out.resize(count);
    for (int64_t size : {1, 3, 4999, 5000, 5001}) {
      if (size < 50 && count > 50)
        continue; // others have shown it
      ASSERT_TRUE(scaleStrips(size, 2)) << count << " in strips of " << size;
      expectScaled();
    }
  }
}

TEST_F(CudaStrips, WhatFailsEndsTheFrame) {
  failAt(4000);
  ASSERT_TRUE(scaleStrips(50)); // the host finds nothing
  expectScaled();
  EXPECT_EQ(launchesOf("piko_strip"), 81u);
  EXPECT_EQ(launchesOf("scale"), 81u + 100u);
}

TEST_F(CudaStrips, AKernelThatFails) {
  strayPointer = true;
  auto status = scaleStrips(50);
  strayPointer = false;
  EXPECT_EQ(status.code(), PIKORT_DEVICE_FAILED);
  expectIn(status, {"running kernel 'scale' of stage 'scaler' (scale.cpp:7): "
                    "CUDA_ERROR_ILLEGAL_ADDRESS"});
  pikoTestDriverReset();
  ASSERT_TRUE(scaleStrips(50));
  expectScaled();
}

// A loop in a graph is more than a driver may take; the host can do the same.
TEST_F(CudaStrips, EachLaunchOrNodeIsRefused) {
  for (const char *name :
       {"cuLaunchKernel", "cuLaunchCooperativeKernel", "cuGraphAddNode",
        "cuGraphConditionalHandleCreate", "cuStreamBeginCaptureToGraph",
        "cuStreamUpdateCaptureDependencies", "cuGraphLaunch"}) {
    pikoTestDriverReset();
    ASSERT_TRUE(scaleStrips(50));
    uint64_t calls = pikoTestDriverCalls(name);
    EXPECT_GT(calls, 0u) << name;
    for (uint64_t n = 1; n <= calls; ++n) {
      pikoTestDriverFail(name, n, CUDA_ERROR_UNKNOWN);
      ASSERT_TRUE(scaleStrips(50)) << name << n;
      expectScaled();
      EXPECT_STREQ(pikoTestDriverAlive(), "") << name << n;
    }
    ASSERT_TRUE(scaleStrips(50)) << name;
    expectScaled();
  }
}

// As MPS does.
TEST_F(CudaStrips, NodesThatAreRefusedAreTheHosts) {
  pikoTestDriverFail("cuGraphAddNode", 1, CUDA_ERROR_NOT_SUPPORTED);
  ASSERT_TRUE(scaleStrips(50));
  expectScaled();
  EXPECT_EQ(hostCounts().graphLaunches, 0u);
  EXPECT_GE(hostCounts().waits, 100u);
}

// The host does no better.
TEST_F(CudaStrips, ALaunchThatFailsWhereLoopsAreRefused) {
  ASSERT_TRUE(scaleStrips(50));
  uint64_t launches = pikoTestDriverCalls("cuLaunchKernel");
  pikoTestDriverFail("cuGraphLaunch", 1, CUDA_ERROR_UNKNOWN);
  pikoTestDriverFail("cuLaunchKernel", launches + 2, CUDA_ERROR_UNKNOWN);
  EXPECT_EQ(scaleStrips(50).code(), PIKORT_DEVICE_FAILED);
  EXPECT_STREQ(pikoTestDriverAlive(), "");
}

// That may pass: it says nothing of loops.
TEST_F(CudaStrips, MemoryThatLacksForAGraph) {
  pikoTestDriverFail("cuGraphInstantiateWithFlags", 1,
                     CUDA_ERROR_OUT_OF_MEMORY);
  EXPECT_EQ(scaleStrips(50).code(), PIKORT_OUT_OF_MEMORY);
  ASSERT_TRUE(scaleStrips(50));
  EXPECT_EQ(hostCounts().graphLaunches, 1u);
}

} // namespace
