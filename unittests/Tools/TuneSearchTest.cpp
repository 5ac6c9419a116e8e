//===- TuneSearchTest.cpp - The search of piko-tune, with made-up costs ---===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Exhaustive.h"
#include "MadeUpBench.h"

#include <gtest/gtest.h>

using namespace piko;
using namespace piko::tune;

namespace {

/// Three pipelines, the last with dimensions of its own: 144 settings.
std::vector<Dimension> makeSpace() {
  return {{"pipe", {"A", "B", "C"}},
          {"tile", {"16", "8", "32", "64"}},
          {"numbers", {"strict", "contracted", "relaxed"}},
          {"leaf", {"4", "8"}},
          {"schedule", {"text", "direct_map", "load_balance"}, 2}};
}

/// Most changes multiply; those of C depend on each other.
double costOf(const Setting &s) {
  const double pipe[] = {10, 7, 8}, tile[] = {1, 1.3, 0.9, 1.1},
               numbers[] = {1, 0.97, 0.85}, leaf[] = {1, 1.2},
               schedule[] = {1, 0.8, 1.05};
  double cost = pipe[s[0]] * tile[s[1]] * numbers[s[2]] * leaf[s[3]];
  if (s[0] == 2)
    cost *= schedule[s[4]] * (s[1] == 3 && s[4] == 1 ? 0.8 : 1);
  return cost;
}

double findBest(const std::function<double(const Setting &)> &cost) {
  double best = INFINITY;
  auto settings = enumerateSettings(makeSpace(), 1000);
  for (const Setting &setting : *settings)
    best = std::min(best, cost(setting));
  return best;
}

TEST(TuneSearch, EnumeratesDimensionsOfAPipelineForItAlone) {
  auto settings = enumerateSettings(makeSpace(), 1000);
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->size(), 2u * 24 + 24 * 3);
  EXPECT_EQ(std::set<Setting>(settings->begin(), settings->end()).size(),
            settings->size());
  EXPECT_EQ(settings->front(), Setting(5, 0));
  EXPECT_FALSE(enumerateSettings(makeSpace(), 119));
}

TEST(TuneSearch, FindsTheBestWithoutNoise) {
  MadeUpBench bench(costOf, 0, 1);
  Search search(makeSpace(), bench, 0, 1000);
  auto outcome = search.run();
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_LE(costOf(outcome->chosen->setting), 1.05 * findBest(costOf));
  EXPECT_EQ(outcome->text->setting, Setting(5, 0));
  EXPECT_EQ(outcome->againstText.wins, outcome->againstText.rounds);
  EXPECT_GT(outcome->againstText.ratio, 1.5);
  EXPECT_FALSE(outcome->isBudgetSpent);
}

TEST(TuneSearch, RegretsLittleWithNoise) {
  int good = 0;
  double best = findBest(costOf);
  for (unsigned seed = 0; seed < 100; ++seed) {
    MadeUpBench bench(costOf, 0.05, seed);
    Search search(makeSpace(), bench, 0, 190); // a tenth of 120 * 16
    auto outcome = search.run();
    ASSERT_TRUE(outcome);
    EXPECT_LE(outcome->runs, 190);
    EXPECT_EQ(bench.visits * runsOfVisit, outcome->runs);
    double regret = costOf(outcome->chosen->setting) / best - 1;
    good += regret < 0.05;
  }
  EXPECT_GE(good, 90);
}

TEST(TuneSearch, IsDeterministic) {
  auto choose = [] {
    MadeUpBench bench(costOf, 0.1, 7);
    Search search(makeSpace(), bench, 0, 200);
    auto outcome = search.run();
    std::vector<Setting> tried;
    for (const Trial &trial : search.getTrials())
      tried.push_back(trial.setting);
    return std::pair(outcome->chosen->setting, tried);
  };
  EXPECT_EQ(choose(), choose());
}

TEST(TuneSearch, StaysWithTheTextWhereNothingIsFaster) {
  int strayed = 0; // a sign test is wrong in one of twenty
  for (unsigned seed = 0; seed < 20; ++seed) {
    MadeUpBench bench([](const Setting &) { return 5.0; }, 0.02, seed);
    Search search(makeSpace(), bench, 0, 400);
    auto outcome = search.run();
    ASSERT_TRUE(outcome);
    strayed += countChanges(outcome->chosen->setting) > 0;
  }
  EXPECT_LE(strayed, 1);
}

TEST(TuneSearch, LeavesOutWhatFailsOrIsWrong) {
  MadeUpBench bench(costOf, 0, 1);
  bench.errorOf = [](const Setting &s) { return s[2] == 2 ? 0.5 : 0.001; };
  bench.broken = {{1, 0, 0, 0, 0}};
  Search search(makeSpace(), bench, 0.004, 1000);
  auto outcome = search.run();
  ASSERT_TRUE(outcome);
  EXPECT_NE(outcome->chosen->setting[2], 2);
  std::set<std::string> problems;
  for (const Trial &trial : search.getTrials())
    problems.insert(trial.problem);
  EXPECT_EQ(problems, (std::set<std::string>{"", "does not compile",
                                             "its error is too large"}));
}

TEST(TuneSearch, SaysThatAnErrorIsImpossible) {
  MadeUpBench bench(costOf, 0, 1);
  bench.errorOf = [](const Setting &) { return 0.5; };
  Search search(makeSpace(), bench, 0.004, 1000);
  auto outcome = search.run();
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().message,
            "no setting that was tried has so small an error; that of what the "
            "text says is 0.500000");
}

TEST(TuneSearch, TakesAChangeThatMakesTheErrorOfTheTextSmaller) {
  MadeUpBench bench(costOf, 0, 1);
  bench.errorOf = [](const Setting &s) { return s[3] == 1 ? 0.001 : 0.5; };
  Search search(makeSpace(), bench, 0.004, 1000);
  auto outcome = search.run();
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(outcome->chosen->setting[3], 1);
}

TEST(TuneSearch, ReportsWhyTheTextDoesNotRun) {
  MadeUpBench bench(costOf, 0, 1);
  bench.broken = {Setting(5, 0)};
  Search search(makeSpace(), bench, 0, 1000);
  auto outcome = search.run();
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().message, "does not compile");
}

TEST(TuneSearch, MakesDoWithAnyBudget) {
  for (int budget : {0, 1, 2, 10, 33, 40}) {
    MadeUpBench bench(costOf, 0.05, 3);
    Search search(makeSpace(), bench, 0, budget);
    auto outcome = search.run();
    ASSERT_TRUE(outcome);
    EXPECT_LE(outcome->runs, std::max(budget, runsOfVisit));
    EXPECT_TRUE(outcome->isBudgetSpent);
  }
}

TEST(TuneSearch, SurveyFindsTheBestAndTheRegret) {
  MadeUpBench bench(costOf, 0.02, 1);
  bench.errorOf = [](const Setting &s) { return s[2] == 2 ? 0.5 : 0.001; };
  Setting chosen{1, 2, 0, 0, 0};
  auto survey = surveyAll(makeSpace(), bench, 0.004, chosen);
  ASSERT_TRUE(survey) << survey.error().message;
  EXPECT_EQ(survey->settings, 120u);
  EXPECT_EQ(survey->programs, 80u);
  ASSERT_EQ(survey->all.size(), 80u);
  EXPECT_NEAR(survey->all[0].ratio, costOf(survey->best) / 10, 0.02);
  EXPECT_EQ(survey->best, (Setting{2, 3, 1, 0, 1}));
  EXPECT_NEAR(survey->regret, costOf(chosen) / costOf(survey->best) - 1, 0.03);
  EXPECT_GT(survey->runs, 80 * exhaustiveRounds * runsOfVisit);
  EXPECT_FALSE(surveyAll(makeSpace(), bench, 0, chosen));
}

TEST(TuneSearch, SignTest) {
  EXPECT_DOUBLE_EQ((Duel{0, 0}).chance(), 1);
  EXPECT_DOUBLE_EQ((Duel{3, 6}).chance(), 1);
  EXPECT_DOUBLE_EQ((Duel{6, 6}).chance(), 2.0 / 64);
  EXPECT_DOUBLE_EQ((Duel{0, 6}).chance(), 2.0 / 64);
  EXPECT_DOUBLE_EQ((Duel{9, 10}).chance(), 2.0 * 11 / 1024);
  EXPECT_FALSE((Duel{6, 6}).isLevel());
  EXPECT_TRUE((Duel{5, 6}).isLevel());
  Duel turned = Duel{2, 6, 0.5}.turned();
  EXPECT_EQ(turned.wins, 4);
  EXPECT_DOUBLE_EQ(turned.ratio, 2);
}

} // namespace
