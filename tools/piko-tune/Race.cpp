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

double Trial::median() const { return medianOf(times); }

double Duel::chance() const {
  int most = std::max(wins, rounds - wins);
  double sum = 0, term = std::pow(0.5, rounds); // of k wins, from all down
  for (int k = rounds; k >= most; --k) {
    sum += term;
    term *= double(k) / (rounds - k + 1);
  }
  return std::min(1.0, 2 * sum);
}

Duel Duel::turned() const {
  return {rounds - wins, rounds, 1 / ratio, 1 / mostRatio, 1 / leastRatio};
}

void Search::leaveOut(Trial *trial, const std::string &why) {
  trial->problem = why;
  bench.release(trial->setting);
}

bool Search::visit(Trial *trial, double *time) {
  runs += runsOfVisit;
  advance(double(runs) / double(budget));
  auto result = bench.visit(trial->setting);
  if (!result) {
    leaveOut(trial, result.error().message);
    return false;
  }
  *time = std::max(*result, 1e-6);
  trial->times.push_back(*time);
  observations.push_back({trial->setting, round, std::log(*time)});
  if (trial->error)
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

void Search::race(std::vector<Trial *> &pool, int rounds) {
  std::map<size_t, std::vector<double>> logs; // by the number of a trial
  for (int i = 0; i < rounds && !pool.empty(); ++i) {
    if (!canRun(pool.size())) {
      isBudgetSpent = true;
      break;
    }
    ++round;
    double time = 0;
    for (size_t j = 0; j < pool.size(); ++j) {
      // To and fro, so that nobody is always the one after the slowest.
      Trial *trial = pool[i % 2 ? pool.size() - 1 - j : j];
      if (visit(trial, &time))
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
  std::sort(pool.begin(), pool.end(), [&](Trial *a, Trial *b) {
    return std::pair(a->score, a->number) < std::pair(b->score, b->number);
  });
}

/// The time that a setting took in each round from some on.
static std::map<size_t, double>
listTimes(const std::vector<CostModel::Observation> &observations,
          const Trial *trial, size_t since) {
  std::map<size_t, double> times;
  for (const CostModel::Observation &observation : observations)
    if (observation.round >= since && observation.setting == trial->setting)
      times[observation.round] = observation.logTime;
  return times;
}

/// How many of the least values are below the median of so many with less than
/// 2.5 %, which bounds it: as a sign test.
static size_t countOutside(size_t rounds) {
  size_t outside = 0;
  while (2 * (outside + 1) <= rounds &&
         Duel{int(outside), int(rounds)}.chance() <= 0.05)
    ++outside;
  return outside > 0 ? outside - 1 : 0;
}

Duel Search::compare(const Trial *first, const Trial *second,
                     size_t since) const {
  Duel duel;
  std::vector<double> ratios;
  auto others = listTimes(observations, second, since);
  for (auto [at, time] : listTimes(observations, first, since)) {
    auto other = others.find(at);
    if (other == others.end())
      continue;
    ++duel.rounds;
    duel.wins += time < other->second;
    ratios.push_back(std::exp(other->second - time));
  }
  if (ratios.empty())
    return duel;
  duel.ratio = medianOf(ratios);
  std::sort(ratios.begin(), ratios.end());
  size_t outside = countOutside(ratios.size());
  duel.leastRatio = ratios[outside];
  duel.mostRatio = ratios[ratios.size() - 1 - outside];
  return duel;
}

Duel Search::fight(Trial *first, Trial *second, size_t since, int most) {
  while (true) {
    Duel duel = compare(first, second, since);
    bool isSure = duel.rounds >= 6 && !duel.isLevel();
    if (isSure || duel.rounds >= most || !canRun(2))
      return duel;
    ++round;
    double time = 0;
    for (int turn : {duel.rounds % 2, 1 - duel.rounds % 2})
      if (!visit(turn ? second : first, &time))
        return duel;
  }
}
