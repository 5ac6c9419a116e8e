// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- MemoryAccessTest.cpp - Loads, stores, atomics, and their faults ----===//

#include "test/DriverFixture.h"

#include <numeric>

using namespace piko::testdriver;

namespace {

class MemoryAccessTest : public DriverTest {
protected:
  /// Runs a kernel that must fail with \p expected; returns the text.
  std::string runFaulty(const std::string &body, CUresult expected,
                        unsigned threads = 32, const std::string &before = "") {
    CUfunction function = load(kernel(body, before));
    CUdeviceptr memory = 0;
    EXPECT_EQ(cuMemAlloc(&memory, 1000), CUDA_SUCCESS);
    EXPECT_EQ(launch(function, 1, threads, {memory, memory}), expected)
        << pikoTestDriverError();
    // It stays, whatever is called.
    EXPECT_EQ(cuMemFree(memory), expected);
    std::string text = pikoTestDriverError();
    renewContext();
    EXPECT_EQ(cuCtxSynchronize(), CUDA_SUCCESS);
    return text;
  }
};

TEST_F(MemoryAccessTest, WidthsAndSigns) {
  std::vector<uint64_t> in(32);
  for (size_t i = 0; i < in.size(); ++i)
    in[i] = 0x8192a3b4c5d6e7f8 + i;
  auto out = run(R"(
    ld.global.s8 %r5, [%rd3];
    ld.global.b8 %rs1, [%rd3+1];
    ld.global.s16 %rd6, [%rd3+2];
    ld.global.nc.b32 %rd7, [%rd3+4];
    cvt.s64.s32 %rd8, %r5;
    cvt.u64.u16 %rd9, %rs1;
    add.s64 %rd8, %rd8, %rd9;
    add.s64 %rd8, %rd8, %rd6;
    add.s64 %rd8, %rd8, %rd7;
    st.global.b64 [%rd4], %rd8;)",
                 in);
  for (size_t i = 0; i < in.size(); ++i) {
    uint64_t value = in[i];
    auto first = static_cast<int8_t>(value);
    auto second = static_cast<int16_t>(value >> 16);
    EXPECT_EQ(out[i], static_cast<uint64_t>(first) + (value >> 8 & 255) +
                          static_cast<uint64_t>(second) + (value >> 32));
  }
}

TEST_F(MemoryAccessTest, VectorsAndSpaces) {
  std::vector<uint64_t> in(64);
  std::iota(in.begin(), in.end(), 100);
  auto out = run(R"(
    .local .align 16 .b8 depot[16];
    .shared .align 16 .b8 block[512];
    mul.wide.u32 %rd5, %r1, 16;
    add.s64 %rd6, %rd1, %rd5;
    ld.global.v4.b32 {%r5, %r6, %r7, _}, [%rd6];
    mov.b64 %rd7, depot;
    cvta.local.u64 %rd7, %rd7;
    st.v2.b32 [%rd7+8], {%r5, %r7};
    ld.local.b64 %rd8, [depot+8];
    mov.b64 %rd9, block;
    add.s64 %rd9, %rd9, %rd5;
    st.shared.b64 [%rd9], %rd8;
    cvta.shared.u64 %rd10, %rd9;
    isspacep.shared %p1, %rd10;
    isspacep.global %p2, %rd10;
    @!%p1 trap;
    @%p2 trap;
    ld.b64 %rd11, [%rd10];
    st.b64 [%rd4], %rd11;)",
                 in);
  for (uint64_t thread = 0; thread < 32; ++thread)
    EXPECT_EQ(out[thread], (101 + 2 * thread) << 32 | (100 + 2 * thread));
}

TEST_F(MemoryAccessTest, Variables) {
  auto out = run(R"(
    ld.global.b64 %rd6, [pointers+8];
    ld.global.b32 %r5, [%rd6+4];
    ld.const.b32 %r6, [constants];
    add.s32 %r5, %r5, %r6;
    cvt.u64.u32 %rd7, %r5;
    st.global.b64 [%rd4], %rd7;)",
                 {}, 32, 1, R"(
.global .align 4 .u32 numbers[3] = {5, 6, 7};
.global .align 8 .u64 pointers[2] = {0, generic(numbers)+4};
.const .align 4 .f32 constants[1] = {0f00000010};)");
  EXPECT_EQ(out[7], 7u + 16);
}

TEST_F(MemoryAccessTest, Atomics) {
  auto out = run(R"(
    atom.global.add.u32 %r5, [%rd2], 3;
    red.global.max.s32 [%rd2+4], %r1;
    atom.global.cas.b64 %rd6, [%rd2+8], 0, 77;
    atom.global.exch.b64 %rd7, [%rd2+16], 9;
    atom.global.add.f32 %f1, [%rd2+24], 0f3f000000;
    atom.global.or.b32 %r6, [%rd2+32], %r1;
    atom.global.inc.u32 %r7, [%rd2+40], 9;)",
                 {});
  EXPECT_EQ(out[0], uint64_t(31) << 32 | 96);
  EXPECT_EQ(out[1], 77u);
  EXPECT_EQ(out[2], 9u);
  EXPECT_EQ(out[3], 0x41800000u);
  EXPECT_EQ(out[4], 31u);
  EXPECT_EQ(out[5], 32u % 10);
}

TEST_F(MemoryAccessTest, BeyondAnAllocation) {
  std::string text =
      runFaulty("st.global.b32 [%rd3+880], %r1;", CUDA_ERROR_ILLEGAL_ADDRESS);
  EXPECT_NE(text.find("of 4 bytes in global memory, byte 1000 of an allocation "
                      "of 1000; kernel 'k', line 23: st.global.b32 "
                      "[%rd3+880], %r1; block (0, 0, 0), thread (15, 0, 0)"),
            text.npos)
      << text;
}

TEST_F(MemoryAccessTest, NullPointers) {
  runFaulty("ld.global.b32 %r5, [0];", CUDA_ERROR_ILLEGAL_ADDRESS);
  runFaulty("mov.b64 %rd6, 0; ld.b32 %r5, [%rd6];", CUDA_ERROR_ILLEGAL_ADDRESS);
  runFaulty("mov.b64 %rd6, 0; ld.shared.b32 %r5, [%rd6];",
            CUDA_ERROR_ILLEGAL_ADDRESS);
}

TEST_F(MemoryAccessTest, Misaligned) {
  std::string text =
      runFaulty("ld.global.b64 %rd6, [%rd1+4];", CUDA_ERROR_MISALIGNED_ADDRESS);
  EXPECT_NE(text.find("misaligned address"), text.npos) << text;
  runFaulty("ld.global.v2.b64 {%rd6, %rd7}, [%rd1+8];",
            CUDA_ERROR_MISALIGNED_ADDRESS);
}

TEST_F(MemoryAccessTest, BeyondSharedAndLocalMemory) {
  runFaulty("mov.b64 %rd6, memory; st.shared.b32 [%rd6+64], %r1;",
            CUDA_ERROR_ILLEGAL_ADDRESS, 32, ".shared .align 4 .b8 memory[64];");
  runFaulty(".local .align 4 .b8 depot[8]; st.local.b32 [depot+8], %r1;",
            CUDA_ERROR_ILLEGAL_ADDRESS);
}

TEST_F(MemoryAccessTest, MemoryOfTheHost) {
  uint64_t number = 0;
  CUfunction function = load(kernel("ld.global.b64 %rd6, [%rd1];"));
  EXPECT_EQ(launch(function, 1, 1, {reinterpret_cast<uint64_t>(&number), 0}),
            CUDA_ERROR_ILLEGAL_ADDRESS);
  renewContext();
}

TEST_F(MemoryAccessTest, MemoryThatWasFreed) {
  CUfunction function = load(kernel("ld.global.b64 %rd6, [%rd1];"));
  CUdeviceptr memory = 0;
  ASSERT_EQ(cuMemAlloc(&memory, 16), CUDA_SUCCESS);
  ASSERT_EQ(cuMemFree(memory), CUDA_SUCCESS);
  EXPECT_EQ(launch(function, 1, 1, {memory, 0}), CUDA_ERROR_ILLEGAL_ADDRESS);
  EXPECT_NE(std::string(pikoTestDriverError()).find("byte 0 of 16 that were"),
            std::string::npos);
  renewContext();
}

TEST_F(MemoryAccessTest, UnwrittenMemoryIsNotZero) {
  auto out = run(R"(
    .shared .align 8 .b8 memory[8];
    ld.shared.b32 %r5, [memory];
    add.s32 %r7, %r5, %r6;
    mov.b64 %rd6, {%r5, %r6};
    st.global.b64 [%rd4], %rd6;)");
  EXPECT_EQ(out[0], 0xcdcdcdcdcdcdcdcd);
}

TEST_F(MemoryAccessTest, NorIsAnyOfALargeAllocation) {
  constexpr size_t bytes = (size_t(9) << 20) + 24, written = size_t(5) << 20;
  CUdeviceptr memory = 0;
  ASSERT_EQ(cuMemAlloc(&memory, bytes), CUDA_SUCCESS);
  ASSERT_EQ(cuMemsetD8Async(memory + written, 1, 8, nullptr), CUDA_SUCCESS);
  for (size_t at : {size_t(0), size_t(4) << 20, written, written + 8,
                    size_t(8) << 20, bytes - 8}) {
    uint64_t word = 0;
    ASSERT_EQ(cuMemcpyDtoHAsync(&word, memory + at, 8, nullptr), CUDA_SUCCESS);
    EXPECT_EQ(word, at == written ? 0x0101010101010101 : 0xcdcdcdcdcdcdcdcd)
        << at;
  }
  EXPECT_EQ(cuMemFree(memory), CUDA_SUCCESS);
}

TEST_F(MemoryAccessTest, UnwrittenRegistersHoldNothingOfOtherBlocks) {
  for (uint32_t last : {31, 15}) {
    auto out = run(R"(
    setp.gt.u32 %p1, %r1, )" +
                   std::to_string(last) + R"(;
    @%p1 bra STORE;
    mov.b32 %r5, 7;
  STORE:
    @!%p1 mov.b32 %r6, 8;
    mov.b64 %rd6, {%r5, %r6};
    st.global.b64 [%rd4], %rd6;)");
    for (uint32_t thread = 0; thread < 32; ++thread)
      EXPECT_EQ(out[thread], thread > last ? 0xcdcdcdcdcdcdcdcd : 0x800000007);
  }
}

TEST_F(MemoryAccessTest, Traps) {
  std::string text = runFaulty("setp.eq.s32 %p1, %r1, 9; @%p1 trap;",
                               CUDA_ERROR_LAUNCH_FAILED);
  EXPECT_NE(text.find("thread (9, 0, 0)"), text.npos) << text;
}

TEST_F(MemoryAccessTest, ThreadsThatWaitForEachOther) {
  std::string text = runFaulty(R"(
    setp.lt.u32 %p1, %r1, 32;
    @%p1 bra FIRST;
    bar.sync 1;
    bra.uni END;
  FIRST:
    bar.sync 0;
  END:)",
                               CUDA_ERROR_LAUNCH_TIMEOUT, 64);
  EXPECT_NE(text.find("kernel 'k', block (0, 0, 0): 64 of 64 at a barrier"),
            text.npos)
      << text;
  text = runFaulty(R"(
    setp.lt.u32 %p1, %r1, 3;
    @%p1 bra SHUFFLE;
    bar.sync 0;
    bra.uni END;
  SHUFFLE:
    shfl.sync.idx.b32 %r5, %r1, 0, 31, -1;
  END:)",
                   CUDA_ERROR_LAUNCH_TIMEOUT);
  EXPECT_NE(text.find("29 of 32 at a barrier, 3 at a warp operation"),
            text.npos)
      << text;
}

TEST_F(MemoryAccessTest, BarriersInPartsOfAWarp) {
  std::string text = runFaulty(R"(
    setp.lt.u32 %p1, %r1, 3;
    @%p1 bra FIRST;
    bar.sync 0;
    bra.uni END;
  FIRST:
    bar.sync 0;
  END:)",
                               CUDA_ERROR_ILLEGAL_INSTRUCTION);
  EXPECT_NE(text.find("come to at different places"), text.npos) << text;
}

} // namespace
