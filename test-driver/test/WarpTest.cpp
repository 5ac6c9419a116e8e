// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- WarpTest.cpp - Divergence, barriers, operations of warps -----------===//

#include "test/DriverFixture.h"

#include <algorithm>
#include <bit>

using namespace piko::testdriver;

namespace {

class WarpTest : public DriverTest {
protected:
  static PikoTestDriverCounts counts() {
    PikoTestDriverCounts counts;
    pikoTestDriverCounts("k", &counts);
    return counts;
  }
};

TEST_F(WarpTest, PartsOfAWarpMeetAgain) {
  auto out = run(R"(
    setp.lt.u32 %p1, %r1, 10;
    @%p1 bra LOW;
    mov.b32 %r5, 2;
    bra.uni JOIN;
  LOW:
    mov.b32 %r5, 1;
  JOIN:
    activemask.b32 %r6;
    mov.b64 %rd6, {%r5, %r6};
    st.global.b64 [%rd4], %rd6;)");
  for (uint64_t thread = 0; thread < 32; ++thread)
    EXPECT_EQ(out[thread], 0xffffffff00000000 | (thread < 10 ? 1 : 2));
}

TEST_F(WarpTest, LoopsOfDifferentLengthsMeetAgain) {
  auto out = run(R"(
    mov.b32 %r5, 0;
  LOOP:
    setp.ge.u32 %p1, %r5, %r1;
    @%p1 bra DONE;
    add.s32 %r5, %r5, 1;
    bra.uni LOOP;
  DONE:
    activemask.b32 %r6;
    mov.b64 %rd6, {%r5, %r6};
    st.global.b64 [%rd4], %rd6;)");
  for (uint64_t thread = 0; thread < 32; ++thread)
    EXPECT_EQ(out[thread], 0xffffffff00000000 | thread);
}

TEST_F(WarpTest, ThreadsThatReturnEarly) {
  auto out = run(R"(
    setp.lt.u32 %p1, %r1, 7;
    @%p1 ret;
    activemask.b32 %r6;
    cvt.u64.u32 %rd6, %r6;
    st.global.b64 [%rd4], %rd6;)");
  for (uint64_t thread = 0; thread < 32; ++thread)
    EXPECT_EQ(out[thread], thread < 7 ? 0 : 0xffffff80u);
}

TEST_F(WarpTest, BranchByIndex) {
  auto out = run(R"(
    and.b32 %r5, %r1, 3;
    TABLE: .branchtargets A, B, C, A;
    brx.idx %r5, TABLE;
  A:
    mov.b64 %rd6, 10;
    bra.uni END;
  B:
    mov.b64 %rd6, 20;
    bra.uni END;
  C:
    mov.b64 %rd6, 30;
  END:
    activemask.b32 %r6;
    cvt.u64.u32 %rd7, %r6;
    shl.b64 %rd7, %rd7, 32;
    or.b64 %rd6, %rd6, %rd7;
    st.global.b64 [%rd4], %rd6;)");
  constexpr uint64_t expected[] = {10, 20, 30, 10};
  for (uint64_t thread = 0; thread < 32; ++thread)
    EXPECT_EQ(out[thread], 0xffffffff00000000 | expected[thread & 3]);
}

TEST_F(WarpTest, BarrierOrdersWarps) {
  // Each thread reads what one of another warp has written.
  auto out = run(R"(
    mov.b64 %rd6, shared;
    mul.wide.u32 %rd7, %r1, 8;
    add.s64 %rd8, %rd6, %rd7;
    cvt.u64.u32 %rd9, %r1;
    st.shared.b64 [%rd8], %rd9;
    bar.sync 0;
    sub.s32 %r5, 95, %r1;
    mul.wide.u32 %rd7, %r5, 8;
    add.s64 %rd8, %rd6, %rd7;
    ld.shared.b64 %rd10, [%rd8];
    st.global.b64 [%rd4], %rd10;)",
                 {}, 96, 2, ".shared .align 8 .b8 shared[768];");
  for (uint64_t thread = 0; thread < 96; ++thread) {
    EXPECT_EQ(out[thread], 95 - thread);
    EXPECT_EQ(out[96 + thread], 95 - thread);
  }
}

TEST_F(WarpTest, ThreadsThatHaveEndedAreNotWaitedFor) {
  auto out = run(R"(
    setp.ge.u32 %p1, %r1, 40;
    @%p1 bra END;
    bar.sync 0;
    mov.b64 %rd6, 1;
    st.global.b64 [%rd4], %rd6;
  END:)",
                 {}, 64);
  EXPECT_EQ(std::count(out.begin(), out.end(), 1u), 40);
}

TEST_F(WarpTest, ShuffleBallotMatchReduce) {
  auto out = run(R"(
    xor.b32 %r5, %r1, 5;
    shfl.sync.idx.b32 %r6, %r5, 3, 31, -1;
    shfl.sync.up.b32 %r7|%p1, %r1, 1, 0, -1;
    shfl.sync.down.b32 %r8, %r1, 2, 31, -1;
    shfl.sync.bfly.b32 %r9, %r1, 16, 31, -1;
    selp.b32 %r10, 1, 0, %p1;
    setp.lt.u32 %p2, %r1, 4;
    vote.sync.ballot.b32 %r11, %p2, -1;
    and.b32 %r12, %r1, 1;
    match.any.sync.b32 %r13, %r12, -1;
    shl.b32 %r6, %r6, 0;
    add.s32 %r14, %r6, %r7;
    add.s32 %r14, %r14, %r8;
    add.s32 %r14, %r14, %r9;
    add.s32 %r14, %r14, %r10;
    add.s32 %r14, %r14, %r11;
    mov.b64 %rd6, {%r14, %r13};
    st.global.b64 [%rd4], %rd6;)");
  for (uint32_t thread = 0; thread < 32; ++thread) {
    uint32_t up = thread ? thread - 1 : thread;
    uint32_t down = thread + 2 < 32 ? thread + 2 : thread;
    uint32_t sum = (3 ^ 5) + up + down + (thread ^ 16) + (thread ? 1 : 0) + 15;
    uint64_t same = thread & 1 ? 0xaaaaaaaau : 0x55555555u;
    EXPECT_EQ(out[thread], same << 32 | sum) << thread;
  }
}

TEST_F(WarpTest, LanesWaitForEachOtherInDifferentGroups) {
  // All lanes of the mask come to the shuffle, but in two groups: one goes
  // around the loop once more.
  auto out = run(R"(
    and.b32 %r5, %r1, 1;
    setp.eq.b32 %p1, %r5, 0;
    @%p1 bra EVEN;
    add.s32 %r6, %r1, 100;
    bra.uni HERE;
  EVEN:
    add.s32 %r6, %r1, 200;
    bra.uni HERE;
  HERE:
    shfl.sync.bfly.b32 %r7, %r6, 1, 31, -1;
    cvt.u64.u32 %rd6, %r7;
    st.global.b64 [%rd4], %rd6;)");
  for (uint32_t thread = 0; thread < 32; ++thread)
    EXPECT_EQ(out[thread], (thread ^ 1) + (thread & 1 ? 200 : 100));
}

TEST_F(WarpTest, LanesThatWaitKeepRegistersOfTheirBlock) {
  // Other lanes run blocks whose registers share places with theirs.
  auto out = run(R"(
    and.b32 %r5, %r1, 1;
    setp.eq.b32 %p1, %r5, 0;
    @%p1 bra EVEN;
    add.s32 %r6, %r1, 100;
    setp.gt.u32 %p2, %r1, 15;
    barrier.sync 0;
    selp.b32 %r7, %r6, 0, %p2;
    add.s32 %r8, %r7, %r6;
    bra.uni STORE;
  EVEN:
    mul.lo.u32 %r9, %r1, 3;
    setp.lt.u32 %p3, %r9, 1000;
    selp.b32 %r10, 7, %r9, %p3;
    add.s32 %r8, %r10, 1;
    barrier.sync 0;
  STORE:
    cvt.u64.u32 %rd6, %r8;
    st.global.b64 [%rd4], %rd6;)");
  for (uint32_t thread = 0; thread < 32; ++thread)
    EXPECT_EQ(out[thread], !(thread & 1) ? 8
                           : thread > 15 ? 2 * (thread + 100)
                                         : thread + 100);
}

TEST_F(WarpTest, CallsKeepTheCallersLanes) {
  auto out = run(R"(
    setp.lt.u32 %p1, %r1, 5;
    @%p1 bra JOIN;
    {
    .param .b32 param0;
    .param .b64 retval0;
    st.param.b32 [param0], %r1;
    call.uni (retval0), twice, (param0);
    ld.param.b64 %rd6, [retval0];
    }
    st.global.b64 [%rd4], %rd6;
  JOIN:)",
                 {}, 32, 1, R"(
.func (.param .b64 func_retval0) twice(.param .b32 twice_param_0)
{
  .reg .pred %p<2>;
  .reg .b32 %r<4>;
  .reg .b64 %rd<4>;
  ld.param.b32 %r1, [twice_param_0];
  setp.lt.u32 %p1, %r1, 20;
  @%p1 bra SMALL;
  mov.b64 %rd1, 1000;
  st.param.b64 [func_retval0], %rd1;
  ret;
SMALL:
  mul.wide.u32 %rd1, %r1, 2;
  st.param.b64 [func_retval0], %rd1;
  ret;
}
)");
  for (uint64_t thread = 0; thread < 32; ++thread)
    EXPECT_EQ(out[thread], thread < 5 ? 0 : thread < 20 ? 2 * thread : 1000);
}

} // namespace
