//===- CostModelTest.cpp - The model of times of piko-tune ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "CostModel.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace piko::tune;

namespace {

/// Effects of two dimensions, once each, in one round.
std::vector<CostModel::Observation> observe(double disturbance = 0) {
  std::vector<CostModel::Observation> seen;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      if (a != 2 || b != 2)
        seen.push_back({{0, a, b}, 1, 0.1 * a - 0.2 * b});
  seen[1].logTime += disturbance;
  return seen;
}

TEST(CostModel, AddsEffectsOfWhatHasNotRunTogether) {
  CostModel model(3);
  model.fit(observe());
  CostModel::Prediction unseen = model.predict({0, 2, 2});
  EXPECT_NEAR(unseen.mean, -0.2, 0.03);
  EXPECT_GT(unseen.deviation, model.predict({0, 1, 1}).deviation);
  EXPECT_GT(model.predict({1, 0, 0}).deviation, unseen.deviation);
}

TEST(CostModel, DoubtsWhatIsMuchSlowerThanTheOthersLetExpect) {
  CostModel model(3);
  model.fit(observe(/*disturbance=*/1.5));
  EXPECT_NEAR(model.predict({0, 0, 1}).mean, -0.2, 0.1);
  EXPECT_NEAR(model.predict({0, 0, 0}).mean, 0, 0.05);
}

TEST(CostModel, TakesTheRoundIntoAccount) {
  CostModel model(2);
  std::vector<CostModel::Observation> seen;
  // The machine is a tenth slower in every other round.
  for (int round = 0; round < 8; ++round)
    for (int value : {0, 1})
      seen.push_back(
          {{0, value}, size_t(round), 0.1 * (round % 2) + 0.05 * value});
  // The third runs in slow ones alone.
  seen.push_back({{0, 2}, 1, 0.1});
  seen.push_back({{0, 2}, 3, 0.1});
  model.fit(seen);
  EXPECT_NEAR(model.predict({0, 2}).mean, model.predict({0, 0}).mean, 0.02);
}

TEST(CostModel, BelievesWhatItPredicts) {
  CostModel model(3);
  model.fit(observe());
  auto before = model.predict({0, 2, 2});
  model.believe({0, 2, 2});
  auto after = model.predict({0, 2, 2});
  EXPECT_NEAR(after.mean, before.mean, 1e-6);
  EXPECT_LT(after.deviation, before.deviation);
}

TEST(CostModel, ExpectsAnImprovement) {
  CostModel::Prediction sure{1, 0}, unsure{1, 0.5};
  EXPECT_DOUBLE_EQ(sure.expectImprovement(1.25), 0.25);
  EXPECT_DOUBLE_EQ(sure.expectImprovement(0.5), 0);
  EXPECT_NEAR(unsure.expectImprovement(1), 0.5 / std::sqrt(2 * M_PI), 1e-9);
  EXPECT_GT(unsure.expectImprovement(0.5), 0);
}

} // namespace
