//===- Exhaustive.cpp - All settings of a space ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Exhaustive.h"

#include "Piko/Scene/ProgressBar.h"

#include <algorithm>
#include <climits>
#include <cmath>

using namespace piko;
using namespace piko::tune;
using render::Error;
using render::Result;

/// Pipelines that are in memory at a time.
static constexpr size_t blockSize = 6;
static constexpr size_t mostSettings = 2000;

/// Ranks settings by their time relative to the text's in the same block.
static std::vector<Trial *> rankAll(Search &search, Bench &bench,
                                    const std::vector<Trial *> &all,
                                    Survey &survey) {
  render::ProgressBar bar("running all settings");
  std::vector<std::pair<double, Trial *>> order;
  Trial *text = all[0];
  for (size_t begin = 1; begin < all.size(); begin += blockSize) {
    size_t end = std::min(all.size(), begin + blockSize);
    std::vector<Trial *> block(all.begin() + std::ptrdiff_t(begin),
                               all.begin() + std::ptrdiff_t(end));
    block.push_back(text);
    search.race(block, Scale::Full, exhaustiveRounds);
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
    survey.times.emplace_back(trial->setting, std::exp(score));
  }
  return ranking;
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
    render::ProgressBar bar("compiling all settings");
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
  constexpr size_t finalists = 4;
  ranking.resize(std::min(ranking.size(), finalists));
  if (std::find(ranking.begin(), ranking.end(), mine) == ranking.end())
    ranking.push_back(mine);
  search.race(ranking, Scale::Full, 2 * exhaustiveRounds);
  survey.best = ranking[0]->setting;
  survey.regret = std::exp(mine->score - ranking[0]->score) - 1;
  return survey;
}
