// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CooperativeTest.cpp - Blocks that wait for each other --------------===//

#include "test/DriverFixture.h"

using namespace piko::testdriver;

namespace {

class CooperativeTest : public DriverTest {
protected:
  void SetUp() override {
    DriverTest::SetUp();
    ASSERT_EQ(cuMemAllocManaged(&memory, 4096, CU_MEM_ATTACH_GLOBAL),
              CUDA_SUCCESS);
    std::memset(reinterpret_cast<void *>(memory), 0, 4096);
  }
  void TearDown() override {
    if (memory) {
      EXPECT_EQ(cuMemFree(memory), CUDA_SUCCESS);
    }
    DriverTest::TearDown();
  }

  /// A kernel that comes to a barrier of the grid \p rounds times, of which all
  /// blocks know but those from the second parameter on; [in] has the counter.
  static std::string barriers(const std::string &sleep = "nanosleep.u32 40;") {
    return kernel(R"(
    mov.u32 %r20, %nctaid.x;
    cvt.u32.u64 %r21, %rd2;
    setp.ge.u32 %p1, %r2, %r21;
    @%p1 bra END;
    mov.b32 %r10, 0;
  ROUND:
    setp.ne.u32 %p2, %r1, 0;
    @%p2 bra TOGETHER;
    atom.acq_rel.gpu.global.add.u32 %r11, [%rd1], 1;
    add.s32 %r12, %r10, 1;
    mul.lo.u32 %r13, %r12, %r20;
  WAIT:
    ld.acquire.gpu.global.u32 %r14, [%rd1];
    setp.ge.u32 %p3, %r14, %r13;
    @%p3 bra TOGETHER;
    )" + sleep + R"(
    bra.uni WAIT;
  TOGETHER:
    bar.sync 0;
    add.s32 %r10, %r10, 1;
    setp.lt.u32 %p4, %r10, 5;
    @%p4 bra ROUND;
  END:)");
  }
  uint32_t counter() const { return *reinterpret_cast<uint32_t *>(memory); }
  void loseContext() {
    renewContext();
    memory = 0;
  }

  CUdeviceptr memory = 0;
};

TEST_F(CooperativeTest, BlocksWaitForEachOther) {
  CUfunction function = load(barriers());
  EXPECT_EQ(launchTogether(function, 12, 96, {memory, 12}), CUDA_SUCCESS)
      << pikoTestDriverError();
  EXPECT_EQ(counter(), 60u);
}

TEST_F(CooperativeTest, BlocksThatDoNotSleepHaveTheirTurns) {
  CUfunction function = load(barriers(""));
  EXPECT_EQ(launchTogether(function, 3, 32, {memory, 3}), CUDA_SUCCESS)
      << pikoTestDriverError();
  EXPECT_EQ(counter(), 15u);
}

TEST_F(CooperativeTest, ABlockThatDoesNotComeIsATimeout) {
  expectsLeaks = true;
  CUfunction function = load(barriers());
  EXPECT_EQ(launchTogether(function, 4, 64, {memory, 3}),
            CUDA_ERROR_LAUNCH_TIMEOUT);
  const std::string text = pikoTestDriverError();
  EXPECT_NE(text.find("threads wait for memory that nothing changes; kernel "
                      "'k', line"),
            text.npos)
      << text;
  EXPECT_NE(text.find("nanosleep.u32 40; block ("), text.npos) << text;
  EXPECT_NE(text.find("; 3 blocks sleep"), text.npos) << text;
  loseContext();
}

TEST_F(CooperativeTest, BlocksOfOtherLaunchesDoNotWait) {
  expectsLeaks = true;
  CUfunction function = load(barriers());
  EXPECT_EQ(launch(function, 1, 64, {memory, 1}), CUDA_SUCCESS);
  std::memset(reinterpret_cast<void *>(memory), 0, 4);
  EXPECT_EQ(launch(function, 4, 64, {memory, 4}), CUDA_ERROR_LAUNCH_TIMEOUT);
  const std::string text = pikoTestDriverError();
  EXPECT_NE(text.find("; 3 blocks have not ended: the launch is not "
                      "cooperative"),
            text.npos)
      << text;
  loseContext();
}

TEST_F(CooperativeTest, LanesOfAWarpWaitForEachOther) {
  // Lane 0 sleeps until lane 1, which waits for it to reconverge, has written.
  CUfunction function = load(kernel(R"(
    setp.ne.u32 %p1, %r1, 0;
    @%p1 bra MEET;
  WAIT:
    nanosleep.u32 %r1;
    ld.volatile.global.u32 %r5, [%rd1];
    setp.eq.u32 %p2, %r5, 0;
    @%p2 bra WAIT;
  MEET:
    mov.b32 %r6, 3;
    st.global.u32 [%rd1], %r6;)"));
  EXPECT_EQ(launch(function, 1, 2, {memory, 0}), CUDA_SUCCESS)
      << pikoTestDriverError();
  EXPECT_EQ(counter(), 3u);
}

TEST_F(CooperativeTest, TheGridMustFit) {
  CUfunction function = load(barriers());
  int blocks = 0, can = 0, processors = 0;
  ASSERT_EQ(
      cuOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, function, 256, 0),
      CUDA_SUCCESS);
  EXPECT_EQ(
      cuDeviceGetAttribute(&can, CU_DEVICE_ATTRIBUTE_COOPERATIVE_LAUNCH, 0),
      CUDA_SUCCESS);
  EXPECT_EQ(can, 1);
  EXPECT_EQ(cuDeviceGetAttribute(&processors,
                                 CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT, 0),
            CUDA_SUCCESS);
  const auto most = static_cast<unsigned>(blocks * processors);
  EXPECT_EQ(launchTogether(function, most, 256, {memory, most}), CUDA_SUCCESS);
  EXPECT_EQ(launchTogether(function, most + 1, 256, {memory, most + 1}),
            CUDA_ERROR_COOPERATIVE_LAUNCH_TOO_LARGE);
  const std::string text = pikoTestDriverError();
  EXPECT_NE(text.find(std::to_string(most + 1) + " blocks, and " +
                      std::to_string(most) + " run at the same time"),
            text.npos)
      << text;
}

TEST_F(CooperativeTest, ReductionsOfBarriers) {
  auto out = run(R"(
    setp.lt.u32 %p1, %r1, 40;
    barrier.cta.red.popc.aligned.u32 %r5, 0, %p1;
    bar.red.and.pred %p2, 1, 96, !%p1;
    bar.red.or.pred %p3, 1, 96, %p1;
    selp.b32 %r6, 100, 0, %p2;
    selp.b32 %r7, 1000, 0, %p3;
    add.s32 %r5, %r5, %r6;
    add.s32 %r5, %r5, %r7;
    cvt.u64.u32 %rd6, %r5;
    st.global.b64 [%rd4], %rd6;)",
                 {}, 96);
  EXPECT_EQ(out, std::vector<uint64_t>(96, 1040));
}

TEST_F(CooperativeTest, TextsOfErrors) {
  EXPECT_EQ(loadError(kernel("nanosleep.u64 %rd3;")),
            "line 23: expected .u32 in 'nanosleep.u64'");
  EXPECT_EQ(loadError(kernel("bar.arrive 0, 64;")),
            "line 23: expected .sync or .red in 'bar.arrive'");
  EXPECT_EQ(loadError(kernel("bar.red.xor.pred %p1, 0, %p2;")),
            "line 23: expected a reduction that is known in "
            "'bar.red.xor.pred'");
}

} // namespace
