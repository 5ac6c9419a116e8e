//===- OrderTest.cpp - Results follow lineage, however they are run -------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Fixture.h"

using namespace conformance;

namespace {

constexpr size_t counts[] = {0, 1, 2, 65, 1500};

/// How a run is divided; no result depends on it.
struct Division {
  int32_t threads;
  int64_t strip, budget;
};
constexpr Division divisions[] = {{1, 0, 0},  {5, 0, 0}, {2, 7, 0},
                                  {2, 97, 0}, {1, 1, 0}, {3, 0, 1 << 20}};

/// Whether a run would take long and show no more than others do.
bool isLeftOut(const Division &division, size_t count) {
  return (division.strip && count > 70 * size_t(division.strip)) ||
         (division.threads == 1 && count > 1000);
}

void divide(Pipeline &pipe, const Division &division) {
  ASSERT_TRUE(pipe.threads(division.threads));
  ASSERT_TRUE(pipe.stripSize(division.strip));
  ASSERT_TRUE(pipe.memoryBudget(division.budget));
}

/// Runs in all divisions, one after the other, and compares the traces.
void expectTraces(Pipeline &pipe, const Traces &expected) {
  pikort_source_info info;
  ASSERT_EQ(pikort_get_source_info(pipe.get(), 0, &info), PIKORT_OK);
  for (const Division &division : divisions) {
    if (isLeftOut(division, size_t(info.count)))
      continue;
    divide(pipe, division);
    EXPECT_RUNS(pipe);
    EXPECT_TRUE(isSame(read<Trace>(pipe, "trace"), expected))
        << division.threads << " threads, strips of " << division.strip
        << ", a budget of " << division.budget;
  }
}

TEST(Order, BranchesAndSourcesJoin) {
  Pipeline pipe = makeTraced(conformance_Joins_program);
  for (size_t first : counts)
    for (size_t second : {size_t(0), size_t(1), size_t(130)}) {
      if (first > 1000 && second != 130)
        continue; // few with few have shown it
      Dots split = makeDots(first, 1), draw = makeDots(second, 2);
      ASSERT_TRUE(pipe.source(0, split));
      ASSERT_TRUE(pipe.source(1, draw));
      SCOPED_TRACE(testing::Message() << first << " and " << second);
      expectTraces(pipe, expectJoins(width, height, bias, split, draw));
    }
}

TEST(Order, StripsThatFitABudget) {
  Pipeline pipe = makeTraced(conformance_Strips_program);
  Dots dots = makeDots(6000, 9);
  ASSERT_TRUE(pipe.source(0, dots));
  Traces expected = expectJoins(width, height, bias, dots, {});
  int64_t all = 0;
  for (int64_t budget : {0, 1 << 20, 1 << 19}) {
    ASSERT_TRUE(pipe.memoryBudget(budget));
    pikort_reset_stats(pipe.get());
    EXPECT_RUNS(pipe);
    EXPECT_TRUE(isSame(read<Trace>(pipe, "trace"), expected)) << budget;
    int64_t peak = pikort_peak_bytes(pipe.get());
    if (!budget)
      all = peak;
    else
      EXPECT_LE(peak, 2 * budget);
  }
  EXPECT_GT(all, 1 << 21) << "expected that a budget matters";
}

/// Of a run in strips of that size, or at once.
int64_t peakBytes(Pipeline &pipe, int64_t strip) {
  EXPECT_TRUE(pipe.threads(1)); // each has some of its own
  EXPECT_TRUE(pipe.stripSize(strip));
  pikort_reset_stats(pipe.get());
  EXPECT_RUNS(pipe);
  return pikort_peak_bytes(pipe.get());
}

TEST(Order, StripsTakeLessMemory) {
  Dots dots = makeDots(5000, 9);
  Pipeline all = makeTraced(conformance_Strips_program);
  ASSERT_TRUE(all.source(0, dots));
  EXPECT_LT(peakBytes(all, 150), peakBytes(all, 0));
  // What is collected has left the strips.
  Pipeline some = makeTraced(conformance_Schedules_program);
  ASSERT_TRUE(some.source(0, dots));
  EXPECT_LT(peakBytes(some, 150), peakBytes(some, 0));
}

void testWalk(const pikort_program &program, bool isOrdered) {
  Pipeline pipe = makeTraced(program);
  for (size_t count : counts) {
    if (isOrdered && count > 70)
      continue; // one after the other
    Walkers walkers = makeWalkers(count, isOrdered ? 9 : 6, 3);
    ASSERT_TRUE(pipe.source(0, walkers));
    SCOPED_TRACE(count);
    expectTraces(pipe, expectWalk(width, height, bias, walkers));
    EXPECT_TRUE(isSame(read<Trace>(pipe, "passed"),
                       isOrdered ? expectPassed(width, height, bias, walkers)
                                 : Traces(width, height)));
  }
}

TEST(Order, CyclesWhoseHopsAreNotSeen) {
  testWalk(conformance_Waves_program, false);
}

TEST(Order, CyclesWhoseHopsAreSeen) {
  testWalk(conformance_Stacks_program, true);
}

void testMeetings(const pikort_program &program, bool isOrdered) {
  Pipeline pipe = makeTraced(program);
  for (size_t first : {0, 2, isOrdered ? 7 : 65})
    for (size_t second : {0, 1, isOrdered ? 5 : 40}) {
      Walkers walkers = makeWalkers(first, 5, 3),
              others = makeWalkers(second, 6, 7);
      ASSERT_TRUE(pipe.source(0, walkers));
      ASSERT_TRUE(pipe.source(1, others));
      Walkers all = walkers; // they do the same wherever they are
      all.insert(all.end(), others.begin(), others.end());
      SCOPED_TRACE(testing::Message() << first << " and " << second);
      Traces expected = expectWalk(width, height, bias, all),
             passed(width, height);
      if (isOrdered)
        passed = expectCrossed(width, height, bias, walkers, others);
      for (int32_t threads : {1, 4}) {
        ASSERT_TRUE(pipe.threads(threads));
        EXPECT_RUNS(pipe);
        EXPECT_TRUE(isSame(read<Trace>(pipe, "trace"), expected));
        EXPECT_TRUE(isSame(read<Trace>(pipe, "passed"), passed));
      }
    }
}

TEST(Order, CyclesThatAreEnteredAtTwoStages) {
  testMeetings(conformance_Meetings_program, false);
}

TEST(Order, CyclesWhoseHopsAreSeenAtOneOfTwoStages) {
  testMeetings(conformance_Crossings_program, true);
}

TEST(Order, CyclesInRounds) {
  Pipeline pipe = makeTraced(conformance_Rounds_program);
  for (size_t count : counts) {
    Walkers walkers = makeWalkers(count, 6, 4);
    ASSERT_TRUE(pipe.source(0, walkers));
    SCOPED_TRACE(count);
    Traces expected = expectRounds(width, height, walkers);
    for (int32_t threads : {1, 4}) {
      ASSERT_TRUE(pipe.threads(threads));
      EXPECT_RUNS(pipe);
      EXPECT_TRUE(isSame(read<Trace>(pipe, "trace"), expected));
    }
  }
}

TEST(Order, SchedulesInAChain) {
  Pipeline pipe = makeTraced(conformance_Schedules_program);
  for (size_t count : counts) {
    Dots dots = makeDots(count, 5);
    ASSERT_TRUE(pipe.source(0, dots));
    SCOPED_TRACE(count);
    Traces expected = expectSchedules(width, height, dots);
    // What is collected is no strip's, and must fit.
    for (const Division &division :
         {Division{1, 0, 0}, Division{7, 0, 0}, Division{2, 97, 0},
          Division{2, 16, 0}, Division{3, 5, 0}}) {
      if (isLeftOut(division, count))
        continue;
      divide(pipe, division);
      EXPECT_RUNS(pipe);
      EXPECT_TRUE(isSame(read<Trace>(pipe, "trace"), expected));
    }
  }
}

TEST(Order, AScheduleForEachBin) {
  Pipeline pipe = makeTraced(conformance_Policies_program);
  constexpr int bins = ((width + 7) / 8) * ((height + 7) / 8);
  for (size_t count : counts) {
    Dots dots = makeDots(count, 6);
    for (Dot &d : dots)
      d.value %= bins;
    ASSERT_TRUE(pipe.source(0, dots));
    SCOPED_TRACE(count);
    expectTraces(pipe, expectPolicies(width, height, dots));
  }
}

TEST(Order, DomainsOfAnySize) {
  Pipeline pipe = makeTraced(conformance_Joins_program);
  const std::pair<int, int> domains[] = {{1, 1}, {7, 100}, {64, 8}, {130, 67}};
  Dots split = makeDots(90, 7), draw = makeDots(40, 8);
  ASSERT_TRUE(pipe.source(0, split));
  ASSERT_TRUE(pipe.source(1, draw));
  for (auto [w, h] : domains) {
    ASSERT_TRUE(pipe.domain({w, h}));
    EXPECT_RUNS(pipe);
    EXPECT_TRUE(isSame(read<Trace>(pipe, "trace"),
                       expectJoins(w, h, bias, split, draw)))
        << w << " x " << h;
  }
}

} // namespace
