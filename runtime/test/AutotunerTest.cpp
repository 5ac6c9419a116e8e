// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- AutotunerTest.cpp - Which versions of its loops a kernel runs ------===//
//
// With times that the test makes up: nothing here depends on a clock.
//
//===----------------------------------------------------------------------===//

#include "cpu/Autotuner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>

using namespace piko::rt;

namespace {

std::vector<Mapping> makeMappings(std::initializer_list<bool> expected) {
  std::vector<Mapping> mappings;
  for (bool vectors : expected) {
    Mapping &mapping = mappings.emplace_back();
    mapping.number = static_cast<int32_t>(mappings.size()) - 1;
    mapping.expected = mapping.chosen = vectors;
  }
  return mappings;
}

/// Units of so many primitives each, in a bucket of their own.
std::vector<pikoir_unit> makeUnits(int64_t count, int64_t primitives) {
  std::vector<pikoir_unit> units;
  for (int64_t u = 0; u < count; ++u)
    units.push_back({u, u + 1, u * primitives, (u + 1) * primitives, -1});
  return units;
}

/// A kernel on two threads, whose units take what `cost` says of a primitive
/// under a mask, times a factor between 1/spread and spread that differs from
/// unit to unit.
class Kernel {
public:
  Kernel(std::vector<Mapping> &mappings, std::function<double(int64_t)> cost,
         double spread = 1)
      : cost(std::move(cost)), spread(spread), tuner(mappings) {}

  void launch(const std::vector<pikoir_unit> &units) {
    tuner.beginLaunch(units);
    int64_t busy = 0;
    for (size_t u = 0; u < units.size(); ++u) {
      AutotunerThread &thread = threads[u % 2];
      int64_t mask = tuner.begin(static_cast<int64_t>(u), thread);
      ++runs[mask];
      // The same for the same unit, launch after launch.
      std::minstd_rand random(static_cast<uint32_t>(u) * 7919 + 1);
      random.discard(3);
      std::uniform_real_distribution<double> factor(-1, 1);
      double primitives = static_cast<double>(units[u].end - units[u].begin);
      auto ticks = static_cast<int64_t>(primitives * cost(mask) *
                                        std::pow(spread, factor(random)));
      busy += ticks;
      tuner.end(units[u], thread, ticks);
    }
    tuner.endLaunch(busy);
  }

  std::function<double(int64_t)> cost;
  double spread;
  Autotuner tuner;
  AutotunerThread threads[2];
  std::map<int64_t, int64_t> runs; ///< Units, by what they ran.
};

TEST(AutotunerTest, KeepsTheFasterVersion) {
  for (bool expected : {false, true})
    for (bool vectorsAreFaster : {false, true}) {
      auto mappings = makeMappings({expected});
      Kernel kernel(mappings, [&](int64_t mask) {
        return (mask == 1) == vectorsAreFaster ? 100.0 : 130.0;
      });
      kernel.launch(makeUnits(200, 50));
      EXPECT_EQ(mappings[0].chosen, vectorsAreFaster);
      EXPECT_EQ(mappings[0].state, PIKORT_MAPPING_MEASURED);
      EXPECT_NEAR(mappings[0].ratio, vectorsAreFaster ? 1 / 1.3 : 1.3, 0.01);
      // The trial took few units of the launch.
      EXPECT_LE(kernel.runs[vectorsAreFaster ? 0 : 1], 20);
      kernel.runs.clear();
      kernel.launch(makeUnits(200, 50));
      EXPECT_EQ(kernel.runs.size(), 1u);
    }
}

TEST(AutotunerTest, TakesTheSumsOfTheSameUnitsWhereTheseDiffer) {
  // Units take up to 10 times as long as others, and one version 5 % less.
  auto mappings = makeMappings({false});
  Kernel kernel(
      mappings, [](int64_t mask) { return mask ? 95.0 : 100.0; },
      /*spread=*/10);
  for (int i = 0; i < 4; ++i)
    kernel.launch(makeUnits(30, 1000));
  EXPECT_TRUE(mappings[0].chosen);
  EXPECT_EQ(mappings[0].state, PIKORT_MAPPING_MEASURED);
}

TEST(AutotunerTest, KeepsWhatIsExpectedWhereItMakesNoDifference) {
  for (bool expected : {false, true}) {
    auto mappings = makeMappings({expected});
    Kernel kernel(mappings, [](int64_t) { return 100.0; });
    for (int i = 0; i < 8; ++i)
      kernel.launch(makeUnits(10, 50));
    EXPECT_EQ(mappings[0].chosen, expected);
    EXPECT_EQ(mappings[0].state, PIKORT_MAPPING_MEASURED);
  }
}

TEST(AutotunerTest, ChangesOneLoopAfterTheOther) {
  // The best is vectors of the second loop, in the scalar version of the first;
  // where the first one is vectors, the second does not run.
  auto mappings = makeMappings({true, false});
  mappings[1].within = 0;
  Kernel kernel(mappings, [](int64_t mask) {
    return mask & 1 ? 120.0 : mask & 2 ? 60.0 : 100.0;
  });
  for (int i = 0; i < 4; ++i)
    kernel.launch(makeUnits(100, 50));
  EXPECT_FALSE(mappings[0].chosen);
  EXPECT_TRUE(mappings[1].chosen);
}

TEST(AutotunerTest, HasAChoiceForEachSizeOfUnits) {
  auto mappings = makeMappings({true});
  double forFew = 0; // what vectors take there
  Kernel kernel(mappings, [&](int64_t mask) { return mask ? forFew : 100.0; });
  auto many = makeUnits(100, 1000), few = makeUnits(100, 3);
  forFew = 50;
  kernel.launch(many);
  EXPECT_TRUE(mappings[0].chosen);
  forFew = 200;
  kernel.launch(few);
  EXPECT_FALSE(mappings[0].chosen);
  // Both are remembered.
  forFew = 50;
  kernel.runs.clear();
  kernel.launch(many);
  EXPECT_TRUE(mappings[0].chosen);
  EXPECT_EQ(kernel.runs[0], 0);
}

TEST(AutotunerTest, TriesAgainWhereTheTimeHasChanged) {
  auto mappings = makeMappings({true});
  double scalar = 200, vectors = 100;
  Kernel kernel(mappings,
                [&](int64_t mask) { return mask ? vectors : scalar; });
  auto units = makeUnits(100, 50);
  for (int i = 0; i < 3; ++i)
    kernel.launch(units);
  EXPECT_TRUE(mappings[0].chosen);
  vectors = 900; // another scene
  scalar = 300;
  for (int i = 0; i < 10; ++i)
    kernel.launch(units);
  EXPECT_FALSE(mappings[0].chosen);
}

TEST(AutotunerTest, RunsWhatTheHostSays) {
  auto mappings = makeMappings({true, false});
  Kernel kernel(mappings, [](int64_t mask) { return mask == 1 ? 1.0 : 100.0; });
  mappings[0].choice = MappingChoice::Scalar;
  mappings[1].choice = MappingChoice::Vectors;
  kernel.launch(makeUnits(100, 50));
  EXPECT_EQ(kernel.runs, (std::map<int64_t, int64_t>{{2, 100}}));
  EXPECT_EQ(mappings[0].state, PIKORT_MAPPING_FIXED);
  EXPECT_EQ(kernel.tuner.getCurrent(), 2);
  // One is fixed, and the other is measured.
  mappings[1].choice = MappingChoice::Measured;
  for (int i = 0; i < 4; ++i)
    kernel.launch(makeUnits(100, 50));
  for (auto [mask, count] : kernel.runs)
    EXPECT_EQ(mask & 1, 0);
  mappings[0].choice = MappingChoice::Expected;
  mappings[1].choice = MappingChoice::Expected;
  kernel.runs.clear();
  kernel.launch(makeUnits(100, 50));
  EXPECT_EQ(kernel.runs, (std::map<int64_t, int64_t>{{1, 100}}));
}

TEST(AutotunerTest, FollowsAHostThatChangesItsMind) {
  auto mappings = makeMappings({false, false});
  Kernel kernel(mappings, [](int64_t mask) { return mask == 0 ? 1.0 : 100.0; });
  for (int i = 0; i < 4; ++i)
    kernel.launch(makeUnits(100, 50));
  EXPECT_EQ(mappings[1].state, PIKORT_MAPPING_MEASURED);
  mappings[0].choice = MappingChoice::Vectors;
  kernel.runs.clear();
  for (int i = 0; i < 4; ++i)
    kernel.launch(makeUnits(100, 50));
  for (auto [mask, count] : kernel.runs)
    EXPECT_EQ(mask & 1, 1);
  mappings[0].choice = MappingChoice::Measured;
  for (int i = 0; i < 4; ++i)
    kernel.launch(makeUnits(100, 50));
  EXPECT_FALSE(mappings[0].chosen);
}

TEST(AutotunerTest, TakesNoLaunchWithoutUnits) {
  auto mappings = makeMappings({true});
  Kernel kernel(mappings, [](int64_t) { return 100.0; });
  kernel.launch({});
  EXPECT_EQ(mappings[0].state, PIKORT_MAPPING_EXPECTED);
  EXPECT_EQ(kernel.tuner.getCurrent(), 1);
}

} // namespace
