// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CountsTest.cpp - What is counted of kernels ------------------------===//

#include "Counts.h"
#include "test/DriverFixture.h"

#include <algorithm>

using namespace piko::testdriver;

namespace {

class CountsTest : public DriverTest {
protected:
  void SetUp() override {
    DriverTest::SetUp();
    pikoTestDriverReset();
  }
  static PikoTestDriverCounts counts() {
    PikoTestDriverCounts counts;
    pikoTestDriverCounts("k", &counts);
    return counts;
  }
};

TEST_F(CountsTest, OfMemory) {
  run("ld.global.b64 %rd6, [%rd3]; setp.lt.u32 %p1, %r1, 8;"
      "@%p1 st.global.b64 [%rd4], %rd6;");
  PikoTestDriverCounts counts;
  ASSERT_EQ(pikoTestDriverCounts("k", &counts), 0);
  EXPECT_EQ(counts.launches, 1u);
  EXPECT_EQ(counts.threads, 32u);
  EXPECT_EQ(counts.warps, 1u);
  EXPECT_EQ(counts.warpInstructions, 13u);
  EXPECT_EQ(counts.laneInstructions, 12u * 32 + 8);
  EXPECT_EQ(counts.loadGlobal, 1u);
  EXPECT_EQ(counts.storeGlobal, 1u);
  EXPECT_EQ(counts.parameter, 2u);
  EXPECT_EQ(counts.globalBytes, 32u * 8 + 8 * 8);
  EXPECT_EQ(counts.globalSectors, 8u + 2);
  EXPECT_EQ(counts.distinctSectors, 8u + 2);
  EXPECT_STREQ(pikoTestDriverKernels(), "k\n");
  EXPECT_EQ(pikoTestDriverCounts("other", &counts), 1);
  EXPECT_EQ(counts.launches, 0u);
}

// Both blocks read the same sectors, and write others.
TEST_F(CountsTest, DistinctSectors) {
  run("ld.global.b64 %rd6, [%rd1]; st.global.b64 [%rd4], %rd6;"
      "ld.global.b64 %rd6, [%rd1+8];",
      {}, 32, 2);
  EXPECT_EQ(counts().globalSectors, 2u * (1 + 8 + 1));
  EXPECT_EQ(counts().distinctSectors, 1u + 2 * 8);
}

TEST_F(CountsTest, Kinds) {
  run("");
  const PikoTestDriverCounts none = counts();
  run(R"(
    add.s32 %r5, %r1, 1;
    and.b32 %r5, %r5, 3;
    add.s64 %rd6, %rd3, %rd4;
    setp.lt.s64 %p1, %rd6, 5;
    div.u32 %r6, %r5, 7;
    rem.u64 %rd7, %rd6, 7;
    cvt.u64.u32 %rd8, %r5;
    cvt.rn.f32.u32 %f1, %r5;
    add.rn.f32 %f2, %f1, %f1;
    div.rn.f32 %f2, %f1, %f1;
    sqrt.rn.f32 %f2, %f1;
    rcp.approx.f32 %f2, %f1;
    cvt.f64.f32 %fd1, %f1;
    add.rn.f64 %fd2, %fd1, %fd1;
    div.rn.f64 %fd2, %fd1, %fd1;)");
  const PikoTestDriverCounts it = counts();
  // Twice what the kernel around them has.
  auto of = [&](uint64_t PikoTestDriverCounts::*member) {
    return it.*member - 2 * (none.*member);
  };
  EXPECT_EQ(of(&PikoTestDriverCounts::integer), 2u);
  EXPECT_EQ(of(&PikoTestDriverCounts::integer64), 2u);
  EXPECT_EQ(of(&PikoTestDriverCounts::integerDivision), 2u);
  EXPECT_EQ(of(&PikoTestDriverCounts::move), 1u);
  EXPECT_EQ(of(&PikoTestDriverCounts::convert), 2u);
  EXPECT_EQ(of(&PikoTestDriverCounts::float32), 1u);
  EXPECT_EQ(of(&PikoTestDriverCounts::float32Division), 2u);
  EXPECT_EQ(of(&PikoTestDriverCounts::special), 1u);
  EXPECT_EQ(of(&PikoTestDriverCounts::float64), 1u);
  EXPECT_EQ(of(&PikoTestDriverCounts::float64Division), 1u);
  EXPECT_EQ(of(&PikoTestDriverCounts::warpInstructions), 15u);
}

// Of 2 warps, the second runs a loop of its own.
TEST_F(CountsTest, LongestWarp) {
  run(R"(
    setp.lt.u32 %p1, %r1, 32;
    @%p1 bra DONE;
    mov.b32 %r5, 0;
  LOOP:
    add.s32 %r5, %r5, 1;
    setp.lt.u32 %p2, %r5, 10;
    @%p2 bra LOOP;
  DONE:)",
      {}, 64);
  EXPECT_EQ(counts().warps, 2u);
  // Both have what is before the loop and after it.
  EXPECT_EQ(2 * counts().longestWarps, counts().warpInstructions + 1 + 3 * 10);
}

// Each block takes one number after the other; what is done for the first takes
// as long as for all others. Where it is run, nothing else is taken.
TEST_F(CountsTest, BlocksTakeWorkInTheOrderInWhichTheyAsk) {
  constexpr uint64_t units = 25, blocks = 4, turns = 1000;
  std::vector<uint64_t> taken = run(R"(
    mov.b64 %rd7, 0;
  NEXT:
    atom.global.add.u64 %rd5, [counter], 1;
    setp.ge.u64 %p1, %rd5, 25;
    @%p1 bra DONE;
    add.s64 %rd7, %rd7, 1;
    setp.eq.u64 %p2, %rd5, 0;
    selp.b32 %r6, 24000, 1000, %p2;
  LOOP:
    sub.s32 %r6, %r6, 1;
    setp.gt.s32 %p3, %r6, 0;
    @%p3 bra LOOP;
    bra.uni NEXT;
  DONE:
    st.global.b64 [%rd4], %rd7;)",
                                    {}, 1, blocks, ".global .u64 counter = 0;");
  std::sort(taken.begin(), taken.end());
  EXPECT_EQ(taken, (std::vector<uint64_t>{1, 8, 8, 8}));
  EXPECT_LT(counts().longestWarps, 3 * units * turns);
  EXPECT_EQ(counts().lastBlocks, counts().longestWarps);
  EXPECT_EQ(counts().atomic, units + blocks);
}

// 1 KB of registers a thread: a multiprocessor has room for few blocks.
TEST_F(CountsTest, BlocksThatFindNoRoomBeginLater) {
  run(R"(
    mov.b32 %r5, 0;
  LOOP:
    add.s32 %r5, %r5, 1;
    setp.lt.u32 %p2, %r5, 100;
    @%p2 bra LOOP;)",
      {}, 1024, 16);
  EXPECT_EQ(counts().lastBlocks, 4 * counts().longestWarps);
}

class SpanTest : public CountsTest {
protected:
  void SetUp() override {
    CountsTest::SetUp();
    ASSERT_EQ(pikoTestDriverLatencies("4,20,30,200"), 0);
  }
  void TearDown() override {
    pikoTestDriverLatencies("");
    CountsTest::TearDown();
  }
  /// Cycles that a text takes more than none.
  std::pair<int64_t, int64_t>
  spansOf(const std::string &text, uint32_t threads = 32, uint32_t blocks = 1) {
    auto measure = [&](const std::string &body) {
      pikoTestDriverReset();
      run(body, {}, threads, blocks);
      return counts();
    };
    const PikoTestDriverCounts none = measure(""), some = measure(text);
    return {int64_t(some.leastSpan - none.leastSpan),
            int64_t(some.mostSpan - none.mostSpan)};
  }
  using Spans = std::pair<int64_t, int64_t>;
};

TEST_F(SpanTest, WaitsForWhatIsRead) {
  // One a cycle, and each 4 after the one that it reads.
  EXPECT_EQ(spansOf("add.s32 %r5, %r1, 1; add.s32 %r6, %r1, 2;"
                    "add.s32 %r7, %r1, 3;"),
            Spans(3, 3));
  EXPECT_EQ(spansOf("add.s32 %r5, %r1, 1; add.s32 %r6, %r5, 2;"
                    "add.s32 %r7, %r6, 3;"),
            Spans(9, 9));
  // A branch waits for its predicate.
  EXPECT_EQ(spansOf("setp.lt.u32 %p1, %r1, 0; @%p1 add.s32 %r5, %r1, 1;"),
            Spans(5, 5));
}

// The address is computed just before: 4 cycles.
TEST_F(SpanTest, LoadsTakeAsLongAsTheirMemory) {
  EXPECT_EQ(spansOf("ld.global.b64 %rd6, [%rd3]; add.s64 %rd7, %rd6, 1;"),
            Spans(206, 206));
  // Both on their way; the second one finds what the first one has asked for.
  EXPECT_EQ(spansOf("ld.global.b64 %rd6, [%rd3]; ld.global.b64 %rd7, [%rd3];"
                    "add.s64 %rd7, %rd6, %rd7;"),
            Spans(206, 206));
  EXPECT_EQ(spansOf("ld.global.b64 %rd6, [%rd3];"), Spans(5, 5));
  // One after the other. A fence empties the cache.
  const std::string twice =
                        "ld.global.b64 %rd6, [%rd3]; add.s64 %rd7, %rd6, 0;",
                    again =
                        "ld.global.b64 %rd6, [%rd3]; add.s64 %rd7, %rd6, 1;";
  EXPECT_EQ(spansOf(twice + again), Spans(238, 238));
  EXPECT_EQ(spansOf(twice + "membar.gl;" + again), Spans(409, 409));
}

// What the block has read is not there behind a fence of the device's scope.
TEST_F(SpanTest, FencesEmptyTheCache) {
  const std::string twice = "ld.global.b64 %rd6, [%rd1];"
                            "add.s64 %rd7, %rd1, %rd6;"
                            "%s ld.global.b64 %rd6, [%rd7];"
                            "add.s64 %rd7, %rd6, 1;";
  auto withFence = [&](const std::string &fence) {
    std::string text = twice;
    return spansOf(text.replace(text.find("%s"), 2, fence), 32, 2);
  };
  const Spans none = withFence(""), all = withFence("membar.gl;"),
              own = withFence("membar.cta;");
  // It is issued while what is read is on its way.
  EXPECT_EQ(all.first - none.first, 170);
  EXPECT_EQ(all.second - none.second, 170);
  EXPECT_EQ(own, none);
}

// What is read again has one place in two sectors with what came between, and
// another one in four.
TEST_F(SpanTest, BlocksHaveEqualPartsOfTheCache) {
  const std::string text = "ld.global.b64 %rd6, [%rd1];"
                           "add.s64 %rd7, %rd1, %rd6;"
                           "ld.global.b64 %rd6, [%rd7+64];"
                           "add.s64 %rd7, %rd1, %rd6;"
                           "ld.global.b64 %rd6, [%rd7];"
                           "add.s64 %rd7, %rd6, 1;";
  auto missesOf = [&](const char *latencies, const std::string &body,
                      uint32_t blocks) {
    EXPECT_EQ(pikoTestDriverLatencies(latencies), 0);
    const Spans spans = spansOf(body, 32, blocks);
    return (spans.second - spans.first) / 170.0;
  };
  EXPECT_EQ(missesOf("4,20,30,200", text, 1), 0);
  EXPECT_EQ(missesOf("4,20,30,200,64", text, 1), 1);
  EXPECT_EQ(missesOf("4,20,30,200,128", text, 1), 0);
  // Of five blocks two are on one of four multiprocessors.
  EXPECT_EQ(missesOf("4,20,30,200,128", text, 4), 0);
  EXPECT_EQ(missesOf("4,20,30,200,128", text, 5), 1);
  EXPECT_EQ(missesOf("4,20,30,200,256", text, 5), 0);
  // Shared memory is in the same array.
  const std::string shared = ".shared .b64 room[8];" + text;
  EXPECT_EQ(missesOf("4,20,30,200,128", shared, 1), 1);
  EXPECT_EQ(missesOf("4,20,30,200,192", shared, 1), 0);
}

// The first of two warps comes 100 iterations later.
TEST_F(SpanTest, BarriersWaitForTheLast) {
  const std::string loop = R"(
    setp.ge.u32 %p1, %r1, 32;
    @%p1 bra DONE;
    mov.b32 %r5, 0;
  LOOP:
    add.s32 %r5, %r5, 1;
    setp.lt.u32 %p2, %r5, 100;
    @%p2 bra LOOP;
  DONE:)";
  const std::string chain = "mul.lo.s32 %r6, %r1, 3; mul.lo.s32 %r6, %r6, 3;"
                            "mul.lo.s32 %r6, %r6, 3; mul.lo.s32 %r6, %r6, 3;";
  const Spans one = spansOf(loop, 64),
              both = spansOf(loop + "bar.sync 0;" + chain, 64);
  EXPECT_GT(one.first, 900);
  EXPECT_EQ(both.first - one.first, 1 + 3 * 4 + 1);
}

TEST_F(SpanTest, LatenciesThatAreNone) {
  for (const char *text :
       {"4,20,30", "4,20,30,200,0", "4,20,30,200,1,1", "4,20,30,200,",
        "4,20,30,200,x", "4,20,30,200,-1", "4,20,30,x", "4,20,,200",
        "4,20,30,-1", " 4,20,30,200", "0,1,1,1", "inf,1,1,1", ","})
    EXPECT_EQ(pikoTestDriverLatencies(text), 1) << text;
  EXPECT_EQ(pikoTestDriverLatencies("4.5,20,30,200"), 0);
  EXPECT_EQ(pikoTestDriverLatencies("4.5,20,30,200,1024"), 0);
}

TEST_F(CountsTest, AsJSON) {
  PikoTestDriverCounts counts{};
  counts.launches = 3;
  counts.distinctSectors = 12;
  std::string text = toJSON(counts);
  EXPECT_EQ(text.find("{\"launches\": 3, \"blocks\": 0, "), 0u) << text;
  EXPECT_NE(text.find("\"distinctSectors\": 12}"), text.npos) << text;
}

} // namespace
