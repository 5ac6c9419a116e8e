//===- TuneRegretTest.cpp - How far from the best piko-tune ends ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Searches in spaces whose times follow from a seed: effects of changes, those
// of a pipeline, and interactions of any two; with noise and disturbed frames.
//
//===----------------------------------------------------------------------===//
#include "MadeUpBench.h"

#include <gtest/gtest.h>

#include <algorithm>

using namespace piko;
using namespace piko::tune;

namespace {

/// A number that follows from others, normally distributed.
double draw(std::initializer_list<unsigned> key) {
  std::seed_seq sequence(key);
  std::mt19937 random(sequence);
  return std::normal_distribution<double>()(random);
}

/// Logarithms add up; most changes are for the worse, as texts are not bad.
double costOf(const Setting &s, unsigned seed) {
  double sum = 0.2 * draw({seed, unsigned(s[0])});
  for (unsigned d = 1; d < s.size(); ++d) {
    if (s[d] == 0)
      continue;
    unsigned value = unsigned(s[d]), pipe = unsigned(s[0]);
    sum += 0.02 + 0.08 * draw({seed, 1, d, value}) +
           0.05 * draw({seed, 2, d, value, pipe});
    for (unsigned e = 1; e < d; ++e)
      if (s[e] != 0)
        sum += 0.03 * draw({seed, 3, d, value, e, unsigned(s[e])});
  }
  return 10 * std::exp(sum);
}

Dimension makeDimension(size_t values, std::optional<int> pipeline = {}) {
  return {"d", std::vector<std::string>(values, "v"), pipeline};
}

/// The regret of a search, as a part of the best time.
double findRegret(const std::vector<Dimension> &dimensions,
                  const std::function<double(const Setting &)> &cost,
                  double best, double noise, unsigned seed, int budget) {
  MadeUpBench bench(cost, noise, seed);
  Search search(dimensions, bench, 0, budget);
  auto outcome = search.run();
  EXPECT_TRUE(outcome);
  EXPECT_LE(outcome->runs, budget);
  return cost(outcome->chosen->setting) / best - 1;
}

TEST(TuneRegret, IsSmallInATenthOfTheRuns) {
  std::vector<Dimension> dimensions = {makeDimension(2), makeDimension(4),
                                       makeDimension(3), makeDimension(2),
                                       makeDimension(2)};
  auto settings = enumerateSettings(dimensions, 1000);
  ASSERT_EQ(settings->size(), 96u);
  std::vector<double> regrets;
  for (unsigned seed = 0; seed < 60; ++seed) {
    auto cost = [&](const Setting &s) { return costOf(s, seed); };
    double best = INFINITY;
    for (const Setting &setting : *settings)
      best = std::min(best, cost(setting));
    // All in 8 rounds of 2 frames would be 1,536.
    regrets.push_back(findRegret(dimensions, cost, best, 0.04, seed, 153));
  }
  std::sort(regrets.begin(), regrets.end());
  EXPECT_LT(regrets[30], 0.01);
  EXPECT_LT(regrets[54], 0.05);
}

/// Twelve dimensions for each of three pipelines: 600,000 settings.
TEST(TuneRegret, IsSmallInALargeSpace) {
  std::vector<Dimension> dimensions = {makeDimension(3)};
  for (int i = 0; i < 7; ++i)
    dimensions.push_back(makeDimension(i < 3 ? 4 : 2));
  for (int pipeline = 0; pipeline < 3; ++pipeline)
    for (int i = 0; i < 5; ++i)
      dimensions.push_back(makeDimension(3, pipeline));
  std::vector<double> regrets;
  for (unsigned seed = 0; seed < 5; ++seed) {
    auto cost = [&](const Setting &s) { return costOf(s, seed); };
    // What a search ends with that has all the time, and no noise.
    MadeUpBench exact(cost, 0, seed);
    Search longer(dimensions, exact, 0, 600);
    double best = cost(longer.run()->chosen->setting);
    regrets.push_back(findRegret(dimensions, cost, best, 0.04, seed, 250));
  }
  std::sort(regrets.begin(), regrets.end());
  EXPECT_LT(regrets[2], 0.1);
}

/// The slower pipeline becomes the faster one without a pass and with other
/// bins: these alone make it slower, and the pass alone is not enough.
TEST(TuneRegret, IsSmallWhereOnlySeveralChangesTogetherHelp) {
  std::vector<Dimension> dimensions = {makeDimension(2), makeDimension(4),
                                       makeDimension(3), makeDimension(2),
                                       makeDimension(2)};
  auto cost = [](const Setting &s) {
    const double relaxed[] = {1, 0.99, 0.96};
    double time = (s[0] == 1 ? 7 : 10) * relaxed[s[2]] * (s[4] ? 1.1 : 1);
    if (s[0] == 1)
      return time * (s[1] || s[3] ? 1.1 : 1);
    if (s[3] == 1)
      return time * (s[1] == 3 ? 0.62 : 0.72);
    return time * (s[1] ? 1.03 : 1);
  };
  const double best = cost({0, 3, 2, 1, 0});
  int good = 0;
  for (unsigned seed = 0; seed < 40; ++seed)
    good += findRegret(dimensions, cost, best, 0.03, seed, 153) < 0.05;
  EXPECT_GE(good, 32);
}

} // namespace
