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
static constexpr int reserve = 48;
/// Of a pipeline that is slower than the best by this changes are not run one
/// by one: few make up for it.
static const double slowPipeline = std::log(2.5);
/// Settings of a round of step 3 that are new, or run once more.
static constexpr size_t proposals = 4;
/// Settings that are compiled for a round at most.
static constexpr int mostCompilations = 12;
/// The model has an opinion on at least so many settings, if there are.
static constexpr size_t leastCandidates = 500;
/// Observations that a model learns from at most: it takes the cube of time.
static constexpr size_t mostObservations = 300;
/// An improvement that is expected to be less is not worth a run.
static const double leastImprovement = 1e-5;
/// Rounds in which nothing better was found before the search ends.
static constexpr int mostIdleRounds = 16;
/// Who runs in turn at last, for how many rounds.
static constexpr size_t finalists = 3;
static constexpr int finalRounds = 6;
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

/// What differs from a setting in one value; also in the pipeline, where its
/// own dimensions are then as the text says.
static std::vector<Setting>
listChanges(const std::vector<Dimension> &dimensions, const Setting &from) {
  std::vector<Setting> changes;
  for (size_t d = 0; d < dimensions.size(); ++d)
    for (size_t value = 0; value < dimensions[d].values.size(); ++value) {
      if (!applies(dimensions[d], from) || int(value) == from[d])
        continue;
      Setting setting = from;
      setting[d] = int(value);
      for (size_t other = 1; other < dimensions.size(); ++other)
        if (!applies(dimensions[other], setting))
          setting[other] = 0;
      changes.push_back(setting);
    }
  return changes;
}

Search::Search(std::vector<Dimension> dimensions, Bench &bench, double limit,
               int budget)
    : log([](const std::string &) {}), dimensions(std::move(dimensions)),
      bench(bench), limit(limit), budget(budget),
      model(this->dimensions.size()) {}

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

/// The pipelines, and their changes of one value, as far as half of the budget
/// goes.
void Search::screen(Trial *text) {
  std::vector<Trial *> bases{text};
  for (size_t value = 1; value < dimensions[0].values.size(); ++value) {
    Setting setting = text->setting;
    setting[0] = int(value);
    if (Trial *trial = getTrial(setting, /*isNew=*/true))
      bases.push_back(trial);
  }
  race(bases, 2);
  const std::vector<Trial *> order = bases;
  for (Trial *base : order) {
    if (base->score - order[0]->score > slowPipeline)
      break;
    std::vector<Trial *> pool{base};
    for (const Setting &setting : listChanges(dimensions, base->setting)) {
      if (setting[0] != base->setting[0])
        continue;
      if (2 * (runs + int(pool.size() + 1) * runsOfVisit) > budget)
        ++missedChanges;
      else if (Trial *trial = getTrial(setting, /*isNew=*/true))
        pool.push_back(trial);
    }
    if (pool.size() == 1)
      continue;
    log(std::to_string(pool.size() - 1) +
        (pool.size() == 2 ? " change" : " changes") + " of one value");
    race(pool, 1);
    for (Trial *trial : pool)
      bench.release(trial->setting);
  }
}

/// Who is allowed, the fastest first as the model sees it.
std::vector<Trial *> Search::rankAllowed() {
  size_t count = std::min(observations.size(), mostObservations);
  model.fit({observations.end() - std::ptrdiff_t(count), observations.end()});
  std::vector<std::pair<double, Trial *>> order;
  for (Trial &trial : trials)
    if (isAllowed(&trial))
      order.emplace_back(model.predict(trial.setting).mean, &trial);
  std::sort(order.begin(), order.end(), [](const auto &a, const auto &b) {
    return std::pair(a.first, a.second->number) <
           std::pair(b.first, b.second->number);
  });
  std::vector<Trial *> ranking;
  for (auto [mean, trial] : order)
    ranking.push_back(trial);
  return ranking;
}

/// Values, with pipeline and dimension, that made a setting fail which did not
/// without them, or gave the same program, where nothing is known that has them
/// and does better.
std::set<std::array<int, 3>> Search::findUselessValues() const {
  std::set<std::array<int, 3>> useless, useful;
  std::vector<const Trial *> fine, failed;
  for (const Trial &trial : trials)
    (isAllowed(&trial) ? fine : failed).push_back(&trial);
  for (const Trial *trial : fine)
    for (size_t d = 1; d < dimensions.size(); ++d)
      useful.insert({trial->setting[0], int(d), trial->setting[d]});
  auto compare = [&](const Setting &with, const Setting &without) {
    auto d = findChange(with, without);
    if (!d)
      return;
    std::array<int, 3> value = {with[0], int(*d), with[*d]};
    if (!useful.contains(value))
      useless.insert(value);
  };
  for (const Trial *a : failed)
    for (const Trial *b : fine)
      compare(a->setting, b->setting);
  for (const auto &[setting, trial] : bySetting)
    compare(setting, trial->setting);
  return useless;
}

/// Settings that may be better than the best, with what is expected of them:
/// what is near those from which most is expected.
Search::Candidates Search::findCandidates(double best) {
  auto useless = findUselessValues();
  auto isGood = [&](const Setting &setting) {
    for (size_t d = 1; d < setting.size(); ++d)
      if (useless.contains({setting[0], int(d), setting[d]}))
        return false;
    auto known = bySetting.find(setting);
    return known == bySetting.end() ||
           (isAllowed(known->second) && known->second->setting == setting);
  };
  std::set<Setting> seen;
  Candidates candidates, unexpanded;
  auto add = [&](const Setting &setting) {
    if (!seen.insert(setting).second || !isGood(setting))
      return;
    double expected = model.predict(setting).expectImprovement(best);
    candidates.emplace(expected, setting);
    unexpanded.emplace(expected, setting);
  };
  for (const Trial &trial : trials)
    add(trial.setting);
  while (!unexpanded.empty() && candidates.size() < leastCandidates) {
    Setting from = unexpanded.begin()->second;
    unexpanded.erase(unexpanded.begin());
    for (const Setting &setting : listChanges(dimensions, from))
      add(setting);
  }
  return candidates;
}

/// The few from which most is expected, one after the other: each is then
/// believed to be as predicted. None if nothing is.
std::vector<Trial *> Search::propose(double best) {
  Candidates candidates = findCandidates(best);
  std::vector<Trial *> chosen;
  // Many may be the same as others, which only compiling shows.
  int most = compilations + mostCompilations;
  while (chosen.size() < proposals && !candidates.empty() &&
         compilations < most) {
    auto first = candidates.extract(candidates.begin());
    Setting &setting = first.value().second;
    // What is believed of others makes it less, never more.
    double expected = model.predict(setting).expectImprovement(best);
    if (!candidates.empty() && expected < candidates.begin()->first) {
      first.value().first = expected;
      candidates.insert(std::move(first));
      continue;
    }
    if (expected < leastImprovement)
      break;
    Trial *trial = getTrial(setting);
    if (!trial || trial->setting != setting)
      continue; // fails, or is the same as another one
    model.believe(setting);
    chosen.push_back(trial);
  }
  return chosen;
}

void Search::explore() {
  const Trial *leader = nullptr;
  for (int idle = 0; !isBudgetSpent && idle < mostIdleRounds; ++idle) {
    std::vector<Trial *> ranking = rankAllowed();
    Trial *first = ranking.empty() ? nullptr : ranking[0];
    if (first != leader)
      idle = 0;
    leader = first;
    const Setting &from = first ? first->setting : trials.front().setting;
    std::vector<Trial *> pool = propose(model.predict(from).mean);
    if (pool.empty())
      return;
    if (first && std::find(pool.begin(), pool.end(), first) == pool.end())
      pool.push_back(first);
    race(pool, 1);
    for (Trial *trial : pool)
      if (trial != first)
        bench.release(trial->setting);
  }
}

/// Whether the first of a duel is the faster one: it is sure, or clear enough
/// where the budget does not let it become so.
static bool isFaster(const Duel &duel) {
  double gain = std::log(duel.ratio);
  return gain >= level &&
         (!duel.isLevel() ||
          (gain >= 3 * level && 3 * duel.wins >= 2 * duel.rounds));
}

/// The best of the finalists, if it is faster than the text; of who is as fast
/// as another one, the one with fewer changes.
void Search::choose(Outcome &outcome) {
  Trial *text = bySetting[Setting(dimensions.size(), 0)];
  std::vector<Trial *> pool = rankAllowed();
  pool.resize(std::min(pool.size(), finalists));
  std::set<const Trial *> isFinalist(pool.begin(), pool.end());
  if (isFinalist.insert(text).second)
    pool.push_back(text);
  size_t since = round + 1;
  race(pool, finalRounds);
  std::vector<Trial *> ranking = rankAllowed();
  std::erase_if(ranking,
                [&](Trial *trial) { return !isFinalist.contains(trial); });
  Trial *first = ranking[0],
        *second = ranking.size() > 1 ? ranking[1] : nullptr;
  outcome.chosen = first;
  if (first != text) {
    Duel duel = outcome.againstText = fight(first, text, since, mostRounds);
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
  Duel duel = fight(first, second, since, mostRounds);
  // Who is to replace the text must be as sure of it as any other.
  bool isSlower = first == text ? isFaster(duel.turned())
                                : duel.ratio < 1 && !duel.isLevel();
  bool isSimpler = std::abs(std::log(duel.ratio)) < level &&
                   countChanges(second->setting) < countChanges(first->setting);
  if (isSlower || isSimpler) {
    std::swap(outcome.chosen, outcome.runnerUp);
    duel = duel.turned();
    outcome.againstText =
        outcome.chosen == text ? Duel{} : compare(outcome.chosen, text, since);
  }
  outcome.againstRunnerUp = duel;
}

Result<Outcome> Search::run() {
  Trial *text = getTrial(Setting(dimensions.size(), 0));
  double time = 0;
  if (!text || !visit(text, &time))
    return Error{trials.front().problem};
  int all = budget, kept = std::min(reserve, all / 2);
  budget = all - kept;
  screen(text);
  int needed = 2 * (runs + missedChanges * runsOfVisit) + reserve;
  explore();
  budget = all;
  if (rankAllowed().empty())
    return Error{
        "no setting that was tried has so small an error; that of what "
        "the text says is " +
        std::to_string(*text->error)};
  Outcome outcome;
  outcome.text = text;
  choose(outcome);
  outcome.runs = runs;
  outcome.compilations = compilations;
  outcome.isBudgetSpent = isBudgetSpent;
  outcome.missedChanges = missedChanges;
  outcome.neededBudget = needed;
  return outcome;
}
