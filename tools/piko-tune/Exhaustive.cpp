//===- Exhaustive.cpp - All settings of a space ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Exhaustive.h"

#include "Piko/CommandLine/Progress.h"

#include <algorithm>
#include <climits>
#include <cmath>
#include <map>

using namespace piko;
using namespace piko::tune;
using render::Error;
using render::Result;

/// Pipelines that are in memory at a time.
static constexpr size_t blockSize = 6;
static constexpr size_t mostSettings = 2000;
/// Those that run once more with the chosen one: so many rounds each time that
/// their pipelines are made anew.
static constexpr size_t surveyFinalists = 6;
static constexpr int surveyRounds = 6, surveyInstances = 4;

/// Ranks settings by their time relative to the text's in the same block.
static std::vector<Trial *> rankAll(Search &search, Bench &bench,
                                    const std::vector<Trial *> &all,
                                    Survey &survey) {
  Progress bar("running all settings");
  std::vector<std::pair<double, Trial *>> order;
  Trial *text = all[0];
  for (size_t begin = 1; begin < all.size(); begin += blockSize) {
    size_t end = std::min(all.size(), begin + blockSize);
    std::vector<Trial *> block(all.begin() + std::ptrdiff_t(begin),
                               all.begin() + std::ptrdiff_t(end));
    block.push_back(text);
    search.race(block, exhaustiveRounds);
    for (Trial *trial : block) {
      if (trial != text)
        order.emplace_back(trial->score - text->score, trial);
      bench.release(trial->setting);
    }
    bar.update(double(end) / double(all.size()));
  }
  order.emplace_back(0, text);
  std::sort(order.begin(), order.end(), [](const auto &a, const auto &b) {
    return std::pair(a.first, a.second->number) <
           std::pair(b.first, b.second->number);
  });
  std::vector<Trial *> ranking;
  for (auto [score, trial] : order) {
    ranking.push_back(trial);
    survey.all.push_back({trial->setting, std::exp(score),
                          trial->error.value_or(0), trial->times});
  }
  return ranking;
}

/// The one whose scores are least together.
static Trial *findBest(Search &search, Bench &bench,
                       std::vector<Trial *> pool) {
  std::map<size_t, double> sums; // by the number of a trial
  for (int i = 0; i < surveyInstances; ++i) {
    search.race(pool, surveyRounds);
    for (Trial *trial : pool) {
      sums[trial->number] += trial->score;
      bench.release(trial->setting);
    }
  }
  return *std::min_element(pool.begin(), pool.end(), [&](Trial *a, Trial *b) {
    return sums[a->number] < sums[b->number];
  });
}

Result<Survey> tune::surveyAll(const std::vector<Dimension> &dimensions,
                               Bench &bench, double limit,
                               const Setting &chosen) {
  auto settings = enumerateSettings(dimensions, mostSettings);
  if (!settings)
    return Error{"--exhaustive: expected at most " +
                 std::to_string(mostSettings) +
                 " settings; --space and --pipe make them fewer"};
  Search search(dimensions, bench, limit, INT_MAX);
  std::vector<Trial *> all;
  {
    Progress bar("compiling all settings");
    for (const Setting &setting : *settings) {
      if (Trial *trial = search.getTrial(setting, /*isNew=*/true);
          trial || all.empty())
        all.push_back(trial ? trial : search.getTrial(setting));
      bar.update(double(search.getTrials().size()) / double(settings->size()));
    }
  }
  Survey survey{.settings = settings->size()};
  std::vector<Trial *> ranking = rankAll(search, bench, all, survey);
  std::erase_if(ranking, [&](Trial *trial) {
    return !trial->problem.empty() || !trial->error || *trial->error > limit;
  });
  survey.programs = ranking.size();
  survey.runs = search.getRuns();
  Trial *mine = search.getTrial(chosen);
  if (ranking.empty() || !mine)
    return Error{"no setting has so small an error"};
  ranking.resize(std::min(ranking.size(), surveyFinalists));
  if (std::find(ranking.begin(), ranking.end(), mine) == ranking.end())
    ranking.push_back(mine);
  Trial *best = findBest(search, bench, ranking);
  survey.best = best->setting;
  if (best == mine)
    return survey;
  Duel duel = search.compare(
      best, mine, search.getRound() + 1 - surveyRounds * surveyInstances);
  survey.regret = duel.ratio - 1;
  survey.leastRegret = duel.leastRatio - 1;
  survey.mostRegret = duel.mostRatio - 1;
  return survey;
}
