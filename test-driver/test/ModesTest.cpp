// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ModesTest.cpp - What a device may do, too --------------------------===//
//
// Each mode finds a fault that is planted, and nothing where it is mended.
//
//===----------------------------------------------------------------------===//

#include "test/DriverFixture.h"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <utility>

using namespace piko::testdriver;

namespace {

class ModesTest : public DriverTest {
protected:
  void TearDown() override {
    pikoTestDriverModes("");
    DriverTest::TearDown();
  }

  /// Lanes swap numbers through shared memory, under a branch that parts them;
  /// how many have got what nobody wrote.
  size_t countUnwritten(const std::string &synchronize) {
    auto out = run(R"(
    mov.u32 %r5, s;
    shl.b32 %r6, %r1, 2;
    add.s32 %r7, %r5, %r6;
    xor.b32 %r8, %r6, 4;
    add.s32 %r8, %r5, %r8;
    and.b32 %r9, %r1, 1;
    setp.eq.u32 %p1, %r9, 0;
    @%p1 bra EVEN;
    mov.b32 %r10, 100;
    bra.uni JOIN;
  EVEN:
    mov.b32 %r10, 200;
  JOIN:
    st.shared.u32 [%r7], %r10;
    )" + synchronize + R"(
    ld.shared.u32 %r11, [%r8];
    cvt.u64.u32 %rd6, %r11;
    st.global.b64 [%rd4], %rd6;)",
                   {}, 32, 32, ".shared .align 4 .b8 s[128];\n");
    return static_cast<size_t>(std::count(out.begin(), out.end(), 0xcdcdcdcdu));
  }

  /// Block 0 writes 7 and then a flag, for which block 1 waits; what that
  /// reads.
  uint32_t passOn(const std::string &fence) {
    CUdeviceptr memory = 0;
    EXPECT_EQ(cuMemAllocManaged(&memory, 64, CU_MEM_ATTACH_GLOBAL),
              CUDA_SUCCESS);
    std::memset(reinterpret_cast<void *>(memory), 0, 64);
    CUfunction function = load(kernel(R"(
    setp.ne.u32 %p1, %r2, 0;
    @%p1 bra WAIT;
    mov.b32 %r5, 7;
    st.global.u32 [%rd1+8], %r5;
    )" + fence + R"(
    mov.b32 %r6, 1;
    atom.relaxed.gpu.global.exch.b32 %r7, [%rd1], %r6;
  STAY:
    nanosleep.u32 40;
    ld.acquire.gpu.global.u32 %r8, [%rd1+4];
    setp.eq.u32 %p2, %r8, 0;
    @%p2 bra STAY;
    bra.uni END;
  WAIT:
    nanosleep.u32 40;
    ld.acquire.gpu.global.u32 %r8, [%rd1];
    setp.eq.u32 %p2, %r8, 0;
    @%p2 bra WAIT;
    ld.global.u32 %r9, [%rd1+8];
    st.global.u32 [%rd1+16], %r9;
    atom.relaxed.gpu.global.exch.b32 %r7, [%rd1+4], 1;
  END:)"));
    EXPECT_EQ(launchTogether(function, 2, 1, {memory, 0}), CUDA_SUCCESS)
        << pikoTestDriverError();
    uint32_t read = reinterpret_cast<uint32_t *>(memory)[4];
    unload();
    EXPECT_EQ(cuMemFree(memory), CUDA_SUCCESS);
    return read;
  }
};

TEST_F(ModesTest, Names) {
  EXPECT_EQ(pikoTestDriverModes("lazy,apart,buffered"), 0);
  EXPECT_EQ(pikoTestDriverModes("late"), 1);
  EXPECT_EQ(pikoTestDriverModes(""), 0);
}

TEST_F(ModesTest, LanesMayStayApart) {
  EXPECT_EQ(countUnwritten(""), 0u);
  pikoTestDriverModes("apart");
  EXPECT_GT(countUnwritten(""), 0u);
  EXPECT_EQ(countUnwritten("bar.warp.sync 0xffffffff;"), 0u);
  EXPECT_EQ(countUnwritten("bar.sync 0;"), 0u);
}

TEST_F(ModesTest, StoresMayBeLate) {
  EXPECT_EQ(passOn(""), 7u);
  pikoTestDriverModes("buffered");
  EXPECT_EQ(passOn(""), 0u);
  EXPECT_EQ(passOn("membar.cta;"), 0u);
  EXPECT_EQ(passOn("membar.gl;"), 7u);
  EXPECT_EQ(passOn("fence.acq_rel.gpu;"), 7u);
}

TEST_F(ModesTest, ABlockSeesItsOwnStores) {
  pikoTestDriverModes("buffered");
  auto out = run(R"(
    mov.b64 %rd6, 0x1122334455667788;
    st.global.b64 [%rd4], %rd6;
    mov.b16 %rs1, 0x99;
    st.global.b8 [%rd4+1], %rs1;
    ld.global.b64 %rd7, [%rd4];
    st.global.b64 [%rd4], %rd7;)");
  for (uint64_t number : out)
    EXPECT_EQ(number, 0x1122334455669988u);
}

TEST_F(ModesTest, FunctionsMayBeLoadedLate) {
  CUfunction function = load(kernel(""));
  CUstream stream = nullptr;
  CUgraph graph = nullptr;
  ASSERT_EQ(cuStreamCreate(&stream, CU_STREAM_NON_BLOCKING), CUDA_SUCCESS);
  auto capture = [&] {
    EXPECT_EQ(cuStreamBeginCapture(stream, CU_STREAM_CAPTURE_MODE_THREAD_LOCAL),
              CUDA_SUCCESS);
    uint64_t none = 0;
    void *parameters[] = {&none, &none};
    CUresult result = cuLaunchKernel(function, 1, 1, 1, 1, 1, 1, 0, stream,
                                     parameters, nullptr);
    std::string text = pikoTestDriverError();
    cuStreamEndCapture(stream, &graph);
    if (graph)
      cuGraphDestroy(std::exchange(graph, nullptr));
    if (result)
      EXPECT_NE(text.find("'k' would be loaded"), text.npos) << text;
    return result;
  };
  pikoTestDriverModes("lazy");
  EXPECT_EQ(capture(), CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED);
  int registers = 0;
  EXPECT_EQ(
      cuFuncGetAttribute(&registers, CU_FUNC_ATTRIBUTE_NUM_REGS, function),
      CUDA_SUCCESS);
  EXPECT_EQ(capture(), CUDA_SUCCESS);
  EXPECT_EQ(cuStreamDestroy(stream), CUDA_SUCCESS);
}

// Blocks ask in another order at each launch.
TEST_F(ModesTest, EachLaunchHasASeed) {
  if (!std::getenv("PIKO_TEST_DRIVER_SEED"))
    GTEST_SKIP() << "blocks come as they are numbered";
  std::set<std::vector<uint64_t>> orders;
  for (int i = 0; i < 8; ++i)
    orders.insert(run(R"(
    mov.b64 %rd6, 1;
    atom.relaxed.gpu.global.add.u64 %rd7, [%rd1], %rd6;
    st.global.b64 [%rd4], %rd7;)",
                      {}, 1, 16));
  EXPECT_GT(orders.size(), 1u);
}

} // namespace
