//===- Race.cpp - Settings that run in turn -------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Times, what is made of them, and who goes on.
//
//===----------------------------------------------------------------------===//
#include "Search.h"

#include <algorithm>
#include <cmath>

using namespace piko;
using namespace piko::tune;

static double medianOf(std::vector<double> values) {
  if (values.empty())
    return 0;
  auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2)
    return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

/// Of an even number the lower one: what disturbs a frame makes it slower.
static double lowerMedianOf(std::vector<double> values) {
  auto middle = values.begin() + std::ptrdiff_t((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double Trial::median() const { return medianOf(full); }

double Duel::chance() const {
  int most = std::max(wins, rounds - wins);
  double sum = 0, term = std::pow(0.5, rounds); // of k wins, from all down
  for (int k = rounds; k >= most; --k) {
    sum += term;
    term *= double(k) / (rounds - k + 1);
  }
  return std::min(1.0, 2 * sum);
}

Duel Duel::turned() const { return {rounds - wins, rounds, 1 / ratio}; }

void Search::leaveOut(Trial *trial, const std::string &why) {
  trial->problem = why;
  bench.release(trial->setting);
}

bool Search::visit(Trial *trial, Scale scale, double *time) {
  runs += runsOfVisit;
  auto result = bench.visit(trial->setting, scale);
  if (!result) {
    leaveOut(trial, result.error().message);
    return false;
  }
  *time = std::max(*result, 1e-6);
  (scale == Scale::Full ? trial->full : trial->small).push_back(*time);
  if (scale == Scale::Small || trial->error)
    return true;
  auto error = bench.measureError(trial->setting);
  if (!error) {
    leaveOut(trial, error.error().message);
    return false;
  }
  trial->error = *error;
  // What the text says is where changes start, whatever its error.
  if (*error <= limit || countChanges(trial->setting) == 0)
    return true;
  leaveOut(trial, "its error is too large");
  return false;
}

/// Rounds of a race: for each, the logarithms of times in the order of
/// settings.
using Rounds = std::vector<std::vector<double>>;

/// How slow each setting is, where rounds are slow or fast as a whole and a few
/// times are disturbed: Tukey's median polish, with lower medians.
static std::vector<double> polish(const Rounds &rounds) {
  size_t count = rounds[0].size();
  std::vector<double> scores(count), offsets(rounds.size(), 0);
  for (int iteration = 0; iteration < 4; ++iteration) {
    for (size_t i = 0; i < count; ++i) {
      std::vector<double> values;
      for (size_t r = 0; r < rounds.size(); ++r)
        values.push_back(rounds[r][i] - offsets[r]);
      scores[i] = iteration ? lowerMedianOf(values)
                            : *std::min_element(values.begin(), values.end());
    }
    for (size_t r = 0; r < rounds.size(); ++r) {
      std::vector<double> values;
      for (size_t i = 0; i < count; ++i)
        values.push_back(rounds[r][i] - scores[i]);
      offsets[r] = lowerMedianOf(values);
    }
  }
  return scores;
}

void Search::race(std::vector<Trial *> &pool, Scale scale, int rounds) {
  std::map<size_t, std::vector<double>> logs; // by the number of a trial
  for (int round = 0; round < rounds && !pool.empty(); ++round) {
    if (runs + int(pool.size()) * runsOfVisit > budget) {
      isBudgetSpent = true;
      break;
    }
    double time = 0;
    for (size_t i = 0; i < pool.size(); ++i) {
      // To and fro, so that nobody is always the one behind the slowest.
      Trial *trial = pool[round % 2 ? pool.size() - 1 - i : i];
      if (visit(trial, scale, &time))
        logs[trial->number].push_back(std::log(time));
    }
    std::erase_if(pool, [](Trial *trial) { return !trial->problem.empty(); });
  }
  if (pool.empty() || logs.empty())
    return;
  Rounds table(logs[pool[0]->number].size());
  for (size_t round = 0; round < table.size(); ++round)
    for (Trial *trial : pool)
      table[round].push_back(logs[trial->number][round]);
  std::vector<double> scores = polish(table);
  for (size_t i = 0; i < pool.size(); ++i)
    pool[i]->score = scores[i];
  rank(pool);
}

/// Sorts settings by their scores, and notes what changes gained.
void Search::rank(std::vector<Trial *> &pool) {
  for (Trial *a : pool)
    for (Trial *b : pool)
      gains[{a->number, b->number}] = b->score - a->score;
  std::sort(pool.begin(), pool.end(), [&](Trial *a, Trial *b) {
    return std::pair(a->score, a->number) < std::pair(b->score, b->number);
  });
}

/// A disturbed frame takes rarely more than twice the time.
static const double mostDisturbance = std::log(2);

/// Runs those from `next` on once more, as one frame may have been disturbed.
void Search::giveSecondChance(std::vector<Trial *> &pool, size_t next,
                              Scale scale) {
  if (runs + int(pool.size() - next + 2) * runsOfVisit > budget)
    return;
  // By two that were not, to know how fast the machine is now.
  double time = 0, offset = -INFINITY;
  for (Trial *anchor : {pool[0], pool[next - 1]})
    if (visit(anchor, scale, &time))
      offset = std::max(offset, anchor->score - std::log(time));
  if (offset == -INFINITY)
    return;
  double most = pool[next - 1]->score + mostDisturbance;
  for (size_t i = next; i < pool.size(); ++i)
    if (pool[i]->score <= most && visit(pool[i], scale, &time))
      pool[i]->score = std::min(pool[i]->score, offset + std::log(time));
  std::erase_if(pool, [](Trial *trial) { return !trial->problem.empty(); });
  rank(pool);
}

void Search::halve(std::vector<Trial *> &pool, size_t keep) {
  // Where what the text says is not allowed, errors come before times.
  auto isGood = [this](Trial *trial) { return isAllowed(trial); };
  Scale scale = std::any_of(pool.begin(), pool.end(), isGood) ? Scale::Small
                                                              : Scale::Full;
  for (int rounds = 1; pool.size() > keep;) {
    race(pool, scale, rounds);
    // Of few all can go at once that are not wanted.
    size_t next = std::max(keep, (pool.size() + 1) / 2);
    if (pool.size() <= 4 * keep)
      next = keep;
    if (rounds == 1 && !isBudgetSpent && next < pool.size())
      giveSecondChance(pool, next, scale);
    if (isBudgetSpent || pool.size() <= keep)
      break;
    for (size_t i = next; i < pool.size(); ++i)
      bench.release(pool[i]->setting);
    pool.resize(std::min(pool.size(), next));
    rounds = scale == Scale::Small ? 1 : std::min(4, rounds * 2);
    scale = Scale::Full;
  }
}

Duel Search::fight(Trial *first, Trial *second, int most) {
  Duel duel;
  std::vector<double> ratios;
  for (int round = 0; round < most; ++round) {
    if (runs + 2 * runsOfVisit > budget)
      break;
    double times[2];
    for (int turn : {round % 2, 1 - round % 2})
      if (!visit(turn ? second : first, Scale::Full, &times[turn]))
        return duel;
    ++duel.rounds;
    duel.wins += times[0] < times[1];
    ratios.push_back(times[1] / std::max(times[0], 1e-6));
    duel.ratio = medianOf(ratios);
    if (duel.rounds >= 6 && !duel.isLevel())
      break;
  }
  return duel;
}
