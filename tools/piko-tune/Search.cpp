//===- Search.cpp - The fastest of many settings --------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Search.h"

#include <algorithm>
#include <cmath>

using namespace piko;
using namespace piko::tune;
using piko::render::Error;
using piko::render::Result;

/// Runs that are kept for the last comparisons.
static constexpr int reserve = 28;
/// A pipeline that is slower than the best by this is not looked at further: no
/// change is expected to make up for it.
static const double slowPipeline = std::log(1.75);
/// A change that made a setting slower by this is not tried again with others.
static const double hopeless = std::log(1.12);
/// What is faster by less is not worth a change.
static const double level = std::log(1.01);
/// In which a duel is decided, or is not.
static constexpr int mostRounds = 12;

int tune::countChanges(const Setting &setting) {
  return int(std::count_if(setting.begin(), setting.end(),
                           [](int value) { return value != 0; }));
}

/// Whether a dimension belongs to a setting's pipeline.
static bool applies(const Dimension &dimension, const Setting &setting) {
  return !dimension.pipeline || *dimension.pipeline == setting[0];
}

std::optional<std::vector<Setting>>
tune::enumerateSettings(const std::vector<Dimension> &dimensions, size_t most) {
  std::vector<Setting> settings{Setting(dimensions.size(), 0)};
  for (size_t d = 0; d < dimensions.size(); ++d) {
    std::vector<Setting> more;
    for (const Setting &setting : settings) {
      size_t count =
          applies(dimensions[d], setting) ? dimensions[d].values.size() : 1;
      for (size_t value = 0; value < count; ++value) {
        more.push_back(setting);
        more.back()[d] = int(value);
      }
      if (more.size() > most)
        return std::nullopt;
    }
    settings = std::move(more);
  }
  return settings;
}

Search::Search(std::vector<Dimension> dimensions, Bench &bench, double limit,
               int budget)
    : log([](const std::string &) {}), dimensions(std::move(dimensions)),
      bench(bench), limit(limit), budget(budget) {}

//===----------------------------------------------------------------------===//
// Trials
//===----------------------------------------------------------------------===//

Trial *Search::getTrial(const Setting &setting, bool isNew) {
  if (auto known = bySetting.find(setting); known != bySetting.end())
    return isNew || !known->second->problem.empty() ? nullptr : known->second;
  trials.push_back({.setting = setting, .number = trials.size()});
  Trial *trial = bySetting[setting] = &trials.back();
  ++compilations;
  auto program = bench.prepare(setting);
  if (!program) {
    trial->problem = program.error().message;
    return nullptr;
  }
  trial->program = *program;
  auto [same, isFirst] = byProgram.try_emplace(*program, trial);
  if (isFirst)
    return trial;
  // One of them is enough.
  trials.pop_back();
  bySetting[setting] = same->second;
  return isNew || !same->second->problem.empty() ? nullptr : same->second;
}

//===----------------------------------------------------------------------===//
// Steps
//===----------------------------------------------------------------------===//

/// The pipelines to start from, the best first.
std::vector<Trial *> Search::findBases(Trial *text) {
  std::vector<Trial *> pool{text};
  for (size_t value = 1; value < dimensions[0].values.size(); ++value) {
    Setting setting = text->setting;
    setting[0] = int(value);
    if (Trial *trial = getTrial(setting, /*isNew=*/true))
      pool.push_back(trial);
  }
  halve(pool, 2);
  if (pool.size() < 2)
    return pool;
  race(pool, Scale::Full, 2);
  if (pool.size() == 2 && pool[1]->score - pool[0]->score > slowPipeline) {
    bench.release(pool[1]->setting);
    pool.pop_back();
  }
  return pool;
}

/// The dimension in which two settings differ, if it is one and no pipeline.
static std::optional<size_t> findChange(const Setting &a, const Setting &b) {
  std::optional<size_t> found;
  for (size_t d = 0; d < a.size(); ++d)
    if (a[d] != b[d]) {
      if (found || d == 0)
        return std::nullopt;
      found = d;
    }
  return found;
}

/// Whether the change of one value to a base, or the same change to another
/// setting of that pipeline, was bad.
bool Search::isHopeless(const Setting &setting, const Setting &base) const {
  size_t d = *findChange(setting, base);
  auto isSameChange = [&](const Setting &from, const Setting &to) {
    return to[0] == base[0] && to[d] == setting[d] && from[d] == base[d] &&
           findChange(from, to) == d;
  };
  for (const auto &[pair, gain] : gains)
    if (gain < -hopeless &&
        isSameChange(trials[pair.second].setting, trials[pair.first].setting))
      return true;
  for (const Trial &trial : trials)
    if (!trial.problem.empty())
      for (const auto &[other, known] : bySetting)
        if (known->problem.empty() && isSameChange(other, trial.setting))
          return true;
  return false;
}

void Search::addChanges(Trial *base, std::vector<Trial *> &pool) {
  for (size_t d = 1; d < dimensions.size(); ++d) {
    if (!applies(dimensions[d], base->setting))
      continue;
    for (size_t value = 0; value < dimensions[d].values.size(); ++value) {
      Setting setting = base->setting;
      setting[d] = int(value);
      if (setting == base->setting || isHopeless(setting, base->setting))
        continue;
      if (Trial *trial = getTrial(setting, /*isNew=*/true))
        pool.push_back(trial);
    }
  }
}

/// Adds, for each base, changes that were good alone, together.
void Search::addCombinations(const std::vector<Trial *> &bases,
                             std::vector<Trial *> &pool) {
  for (Trial *base : bases) {
    std::map<size_t, std::pair<double, int>> best; // gain, value
    for (const auto &[pair, gain] : gains) {
      const Trial &trial = trials[pair.first];
      auto d = findChange(trial.setting, base->setting);
      if (pair.second != base->number || gain < 2 * level || !d ||
          !mayBeAllowed(trial))
        continue;
      auto candidate = std::pair(gain, trial.setting[*d]);
      best[*d] = std::max(best[*d], candidate);
    }
    std::vector<std::pair<double, size_t>> order;
    for (const auto &[dimension, gain] : best)
      order.emplace_back(-gain.first, dimension);
    std::sort(order.begin(), order.end());
    // Two of the best three, and all of them.
    order.resize(std::min<size_t>(order.size(), 3));
    for (unsigned chosen : {3u, 5u, 6u, 7u}) {
      if (chosen >> order.size() != 0)
        continue;
      Setting setting = base->setting;
      for (size_t i = 0; i < order.size(); ++i)
        if (chosen >> i & 1)
          setting[order[i].second] = best[order[i].second].second;
      if (Trial *trial = getTrial(setting, /*isNew=*/true))
        pool.push_back(trial);
    }
  }
}

/// About how many runs it takes to find the best of so many settings.
static int costOf(size_t settings) {
  return 4 * int(settings) + 12 * runsOfVisit;
}

/// Steps 1 to 3: the settings that raced last, the fastest first.
std::vector<Trial *> Search::improve(Trial *text) {
  std::vector<Trial *> bases = findBases(text), ranking = bases;
  constexpr int mostGenerations = 4;
  for (int i = 0; i < mostGenerations && !isBudgetSpent; ++i) {
    std::vector<Trial *> pool = bases;
    for (Trial *base : bases)
      // All changes of one pipeline are worth more than some of two.
      if (base == bases[0] || runs + costOf(2 * pool.size()) <= budget)
        addChanges(base, pool);
    if (pool.size() == bases.size())
      break;
    log(std::to_string(pool.size() - bases.size()) + " changes of " +
        std::to_string(bases.size()) +
        (bases.size() == 1 ? " setting" : " settings"));
    halve(pool, 3);
    addCombinations(bases, pool);
    race(pool, Scale::Full, 2);
    std::erase_if(pool, [](Trial *trial) { return trial->full.empty(); });
    if (pool.empty())
      break;
    ranking = pool;
    if (pool[0] == bases[0])
      break;
    bases = {pool[0]};
  }
  return ranking;
}

/// Whether the first of a duel is the faster one: it is sure, or clear enough
/// where the budget does not let it become so.
static bool isFaster(const Duel &duel) {
  double gain = std::log(duel.ratio);
  return gain >= level &&
         (!duel.isLevel() ||
          (gain >= 3 * level && 3 * duel.wins >= 2 * duel.rounds));
}

/// The best that raced last, if it is faster than the text; of who is as fast
/// as another one, the one with fewer changes.
void Search::choose(std::vector<Trial *> ranking, Outcome &outcome) {
  Trial *text = bySetting[Setting(dimensions.size(), 0)];
  Trial *first = ranking[0],
        *second = ranking.size() > 1 ? ranking[1] : nullptr;
  outcome.chosen = first;
  if (first != text) {
    Duel duel = outcome.againstText = fight(first, text, mostRounds);
    if (isAllowed(text) && !isFaster(duel)) {
      outcome.chosen = text;
      outcome.runnerUp = first;
      outcome.againstText = {};
      outcome.againstRunnerUp = duel.turned();
      return;
    }
  }
  outcome.runnerUp = second;
  if (!second)
    return;
  Duel duel = first != text && second == text
                  ? outcome.againstText
                  : fight(first, second, mostRounds);
  bool isSlower = duel.ratio < 1 && !duel.isLevel();
  bool isSimpler = std::abs(std::log(duel.ratio)) < level &&
                   countChanges(second->setting) < countChanges(first->setting);
  if (isSlower || isSimpler) {
    std::swap(outcome.chosen, outcome.runnerUp);
    duel = duel.turned();
  }
  outcome.againstRunnerUp = duel;
}

Result<Outcome> Search::run() {
  Trial *text = getTrial(Setting(dimensions.size(), 0));
  double time = 0;
  if (!text || !visit(text, Scale::Full, &time))
    return Error{trials.front().problem};
  int all = budget;
  budget = std::max(all - reserve, 0);
  std::vector<Trial *> ranking = improve(text);
  if (std::find(ranking.begin(), ranking.end(), text) == ranking.end())
    ranking.push_back(text);
  std::erase_if(ranking, [&](Trial *trial) { return !isAllowed(trial); });
  budget = all;
  if (ranking.empty())
    return Error{
        "no setting that was tried has so small an error; that of what "
        "the text says is " +
        std::to_string(*text->error)};
  Outcome outcome;
  outcome.text = text;
  choose(std::move(ranking), outcome);
  outcome.runs = runs;
  outcome.compilations = compilations;
  outcome.isBudgetSpent = isBudgetSpent;
  return outcome;
}
