//===- ErrorTest.cpp - Errors, and the run after them ---------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Fixture.h"

#include <limits>

using namespace conformance;

namespace {

/// What is asked of the pipelines in these tests.
class Error : public testing::Test {
protected:
  /// Bins of 8 pixels.
  static constexpr int bins = ((width + 7) / 8) * ((height + 7) / 8);

  static Dots makePlaces(size_t count) {
    Dots dots = makeDots(count, 1);
    for (Dot &d : dots)
      d.value %= bins;
    return dots;
  }
  static void expectPolicies(Pipeline &pipe, const Dots &dots) {
    EXPECT_RUNS(pipe);
    EXPECT_TRUE(isSame(read<Trace>(pipe, "trace"),
                       conformance::expectPolicies(width, height, dots)));
  }
};

TEST_F(Error, BinOutsideIsThatOfTheFirstPrimitive) {
  Pipeline pipe = makeTraced(conformance_Policies_program);
  Dots good = makePlaces(400), bad = good;
  bad[150].value = bins;
  bad[220].value = -2;
  bad[390].value = bins + 1;
  for (int32_t threads : {1, 2, 6})
    for (int64_t strip : {0, 32}) {
      ASSERT_TRUE(pipe.threads(threads));
      ASSERT_TRUE(pipe.stripSize(strip));
      ASSERT_TRUE(pipe.source(0, bad));
      expectError(pipe.run(), PIKORT_BIN_OUTSIDE,
                  {"'place'", "expected a bin id in [0, 24), but got 24"});
      ASSERT_TRUE(pipe.source(0, good));
      expectPolicies(pipe, good);
    }
}

TEST_F(Error, IndexOutsideIsThatOfTheFirstPrimitive) {
  Pipeline pipe = make(conformance_Frames_program);
  std::vector<int32_t> table(16), sums(8), found(1), finds{0};
  Items good = makeItems(300, 2), bad = good;
  for (size_t i : {120u, 121u, 260u})
    bad[i].kind = int32_t(1000 + i);
  ASSERT_TRUE(pipe.constant("scale", int32_t(0)));
  ASSERT_TRUE(pipe.buffer("table", table));
  ASSERT_TRUE(pipe.buffer("sums", sums));
  ASSERT_TRUE(pipe.buffer("found", found));
  ASSERT_TRUE(pipe.source(1, finds));
  for (int32_t threads : {1, 4}) {
    ASSERT_TRUE(pipe.threads(threads));
    ASSERT_TRUE(pipe.source(0, bad));
    expectError(
        pipe.run(), PIKORT_INDEX_OUTSIDE,
        {"'count'", "expected an index into 'table' in [0, 16), but got 1120"});
    ASSERT_TRUE(pipe.source(0, good));
    EXPECT_RUNS(pipe);
  }
  // While the host goes on.
  ASSERT_TRUE(pipe.source(0, bad));
  Status status = pipe.runAsync();
  expectError(
      status ? pipe.wait() : status, PIKORT_INDEX_OUTSIDE,
      {"'count'", "expected an index into 'table' in [0, 16), but got 1120"});
  EXPECT_TRUE(pipe.wait());
  // A position that is no number.
  bad = good;
  bad[77].y = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(pipe.source(0, bad));
  expectError(pipe.run(), PIKORT_NOT_A_NUMBER,
              {"'test'", "expected positions of numbers, but got NaN"});
  ASSERT_TRUE(pipe.source(0, good));
  EXPECT_RUNS(pipe);
}

TEST_F(Error, NumbersThatAreNoIndices) {
  Pipeline pipe = make(conformance_Fetches_program);
  Items items = makeItems(20, 4);
  for (size_t i = 0; i < items.size(); ++i)
    items[i].kind = int32_t(i % 5);
  std::vector<int32_t> indices{3, 19, 0, 4, 4}, sums(5),
      table{1, 2, 3, 19, 5, 6, 7, 0, 9, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 4};
  auto expectSums = [&] {
    std::vector<int32_t> expected(5);
    for (int32_t i : indices) {
      expected[i % 5] += table[i % 5] + i;
      expected[table[i] % 5] += 1;
    }
    sums.assign(5, 0);
    EXPECT_RUNS(pipe);
    EXPECT_EQ(sums, expected);
  };
  ASSERT_TRUE(pipe.source(0, indices));
  ASSERT_TRUE(pipe.buffer("items", items));
  ASSERT_TRUE(pipe.buffer("table", table));
  ASSERT_TRUE(pipe.buffer("sums", sums));
  expectSums();
  std::vector<int32_t> wrong = indices;
  wrong[3] = 20;
  wrong[4] = -1;
  ASSERT_TRUE(pipe.source(0, wrong));
  for (int run = 0; run < 2; ++run)
    expectError(pipe.run(), PIKORT_INDEX_OUTSIDE,
                {"stage 'fetch': expected primitive 3 of source 0 to be an "
                 "index into 'items', in [0, 20), but got 20"});
  ASSERT_TRUE(pipe.source(0, indices));
  expectSums();
  items[19].kind = 5;
  ASSERT_TRUE(pipe.buffer("items", items));
  expectError(pipe.run(), PIKORT_INDEX_OUTSIDE,
              {"buffer 'items': expected field 'kind' of element 19 to be an "
               "index into 'sums', in [0, 5), but got 5"});
  items[19].kind = 4;
  ASSERT_TRUE(pipe.buffer("items", items));
  table[2] = 77;
  ASSERT_TRUE(pipe.buffer("table", table));
  expectError(pipe.run(), PIKORT_INDEX_OUTSIDE,
              {"buffer 'table': expected element 2 to be an index into "
               "'items', in [0, 20), but got 77"});
  table[2] = 0;
  ASSERT_TRUE(pipe.buffer("table", table));
  expectSums();
  // An index that has no contract is tested in the kernel. What it reads then
  // may be read at, even where there is nothing.
  std::vector<int32_t> few{1, 1, 1, 1, 1};
  ASSERT_TRUE(pipe.buffer("table", few));
  expectError(pipe.run(), PIKORT_INDEX_OUTSIDE,
              {"'again'", "expected an index into 'table' in [0, 5), but got "
                          "19"});
  ASSERT_TRUE(pipe.buffer("table", table));
  expectSums();
}

TEST_F(Error, LoopsThatDoNotEnd) {
  for (const auto *program :
       {&conformance_Waves_program, &conformance_Stacks_program,
        &conformance_Rounds_program}) {
    Pipeline pipe = makeTraced(*program);
    bool isWalk = program != &conformance_Rounds_program;
    Walkers walkers = makeWalkers(60, 8, 5);
    walkers[31].left = 9;
    ASSERT_TRUE(pipe.source(0, walkers));
    ASSERT_TRUE(pipe.loopLimit(4));
    expectError(
        pipe.run(), PIKORT_ENDLESS,
        {isWalk ? "'walk'" : "'gather'", "a loop did not end within 4 "});
    ASSERT_TRUE(pipe.loopLimit(100));
    EXPECT_RUNS(pipe);
    Traces expected = isWalk ? expectWalk(width, height, bias, walkers)
                             : expectRounds(width, height, walkers);
    EXPECT_TRUE(isSame(read<Trace>(pipe, "trace"), expected));
  }
}

TEST_F(Error, MemoryThatIsTooLittle) {
  Pipeline pipe = makeTraced(conformance_Joins_program);
  Dots split = makeDots(6000, 6), draw = makeDots(10, 7);
  ASSERT_TRUE(pipe.source(0, split));
  ASSERT_TRUE(pipe.source(1, draw));
  ASSERT_TRUE(pipe.memoryLimit(100000));
  for (int i = 0; i < 2; ++i)
    expectError(pipe.run(), PIKORT_OUT_OF_MEMORY, {"out of memory"});
  ASSERT_TRUE(pipe.memoryLimit(0));
  EXPECT_RUNS(pipe);
  EXPECT_TRUE(isSame(read<Trace>(pipe, "trace"),
                     expectJoins(width, height, bias, split, draw)));
}

TEST_F(Error, WhatIsNotBound) {
  Pipeline pipe(conformance_Frames_program);
  ASSERT_TRUE(pipe.created()) << pipe.created().message();
  expectError(pipe.run(), PIKORT_UNBOUND, {"the domain is not set"});
  ASSERT_TRUE(pipe.domain({width, height}));
  expectError(pipe.run(), PIKORT_UNBOUND, {"'scale'"});
  ASSERT_TRUE(pipe.constant("scale", int32_t(1)));
  std::vector<int32_t> numbers(80), finds{1};
  expectError(pipe.run(), PIKORT_UNBOUND, {"'table'"});
  std::vector<int32_t> sums(8), found(8);
  ASSERT_TRUE(pipe.buffer("table", numbers));
  ASSERT_TRUE(pipe.buffer("sums", sums));
  ASSERT_TRUE(pipe.buffer("found", found));
  // A source that is not bound has no primitives.
  EXPECT_RUNS(pipe);
  EXPECT_EQ(sums, std::vector<int32_t>(8));
  Items items = makeItems(5, 1);
  ASSERT_TRUE(pipe.source(0, items));
  EXPECT_RUNS(pipe);
  ASSERT_TRUE(pipe.source(1, finds));
  EXPECT_RUNS(pipe);
}

TEST_F(Error, ArgumentsThatMakeNoSense) {
  Pipeline pipe = make(conformance_Joins_program);
  Items items = makeItems(3, 1);
  EXPECT_EQ(pipe.source(0, items).code(), PIKORT_SIZE_MISMATCH);
  EXPECT_EQ(pipe.source(2, makeDots(1, 1)).code(), PIKORT_NOT_FOUND);
  EXPECT_EQ(pipe.constant("bias", int64_t(1)).code(), PIKORT_SIZE_MISMATCH);
  EXPECT_EQ(pipe.constant("none", int32_t(1)).code(), PIKORT_NOT_FOUND);
  EXPECT_EQ(pipe.domain({0, 5}).code(), PIKORT_INVALID_ARGUMENT);
  EXPECT_EQ(pipe.domain({5}).code(), PIKORT_INVALID_ARGUMENT);
  EXPECT_EQ(pipe.threads(-1).code(), PIKORT_INVALID_ARGUMENT);
  EXPECT_EQ(pipe.allocate("trace", 5).code(), PIKORT_INVALID_ARGUMENT);
}

} // namespace
