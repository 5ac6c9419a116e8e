//===- Search.h - The fastest of many settings ------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A setting has a value in each dimension. Most products of values are never
// run:
//
//   1. The pipelines run as the text has them.
//   2. Each change of one value of these runs, the fastest pipeline's first.
//   3. A model of times (CostModel.h) learns from all that ran, and says what
//      else may be faster than the best, and by how much: the expected
//      improvement. Those few for which it is greatest run, with the best so
//      far; and 3 again, until nothing is expected any more.
//   4. The best few and what the text says run in turn. The winner meets the
//      text and the runner-up further, until a sign test is sure.
//
// Who is compared runs in turn, so that a machine which is slower for a while
// is so for all. A setting whose error is too large is left out when its first
// image is there.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_PIKOTUNE_SEARCH_H
#define PIKO_TOOLS_PIKOTUNE_SEARCH_H

#include "CostModel.h"

#include "Piko/Scene/Result.h"

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace piko::tune {

struct Dimension {
  std::string name;
  /// The first is what the text says.
  std::vector<std::string> values;
  /// The value of dimension 0, the pipeline, that it belongs to; none = all.
  std::optional<int> pipeline = {};
};

/// All settings of a space, in order; nothing if they are more than `most`.
std::optional<std::vector<Setting>>
enumerateSettings(const std::vector<Dimension> &dimensions, size_t most);

/// Where settings run.
class Bench {
public:
  virtual ~Bench() = default;
  /// Compiles a setting. Those with the same number run the same program.
  virtual render::Result<uint64_t> prepare(const Setting &setting) = 0;
  /// Runs two frames: the milliseconds of the faster one.
  virtual render::Result<double> visit(const Setting &setting) = 0;
  /// How far the last image is from what it should be.
  virtual render::Result<double> measureError(const Setting &setting) = 0;
  /// Frees what only visits need; they may come again.
  virtual void release(const Setting &setting) = 0;
};

/// Frames that Bench::visit() runs.
inline constexpr int runsOfVisit = 2;

/// What is known of a setting.
struct Trial {
  Setting setting;
  size_t number = 0; ///< in the order in which settings were tried
  uint64_t program = 0;
  std::vector<double> times = {}; ///< milliseconds
  std::optional<double> error = {};
  std::string problem = {}; ///< why it is left out; empty if it is not
  /// Of its last race: the logarithm of its time.
  double score = 0;

  /// Of its times; 0 where there is none.
  double median() const;
};

/// How one setting fared against another one, in turn.
struct Duel {
  int wins = 0, rounds = 0; ///< of the first
  double ratio = 1;         ///< median time of the second, of the first's
  /// Within which that median is with 95 %, as far as there are enough rounds.
  double leastRatio = 1, mostRatio = 1;

  /// How likely so many wins, or losses, would be if both were equally fast: a
  /// two-sided sign test.
  double chance() const;
  /// Whether neither is the faster one.
  bool isLevel() const { return chance() > 0.05; }
  /// The same for the second.
  Duel turned() const;
};

struct Outcome {
  const Trial *text = nullptr, *chosen = nullptr;
  const Trial *runnerUp = nullptr; ///< null if there is no other
  Duel againstRunnerUp, againstText;
  int runs = 0, compilations = 0;
  bool isBudgetSpent = false;
  /// Changes of one value for which the budget is too small, and one that is
  /// not.
  int missedChanges = 0, neededBudget = 0;
};

class Search {
public:
  /// `limit` is of the error, `budget` of runs.
  Search(std::vector<Dimension> dimensions, Bench &bench, double limit,
         int budget);

  /// An error if what the text says cannot run, or nothing has so small an
  /// error.
  render::Result<Outcome> run();

  /// In the order in which they were tried.
  const std::deque<Trial> &getTrials() const { return trials; }
  /// The trial of a setting, which is prepared if it is new; null if it is
  /// left out, or another one runs the same program and `isNew` is asked for.
  Trial *getTrial(const Setting &setting, bool isNew = false);
  /// Lets settings run in turn; ranks them, and leaves out who fails.
  void race(std::vector<Trial *> &pool, int rounds);
  /// How two fared in the rounds from `since` on; ends when a sign test is
  /// sure, after `most` rounds, or with the budget.
  Duel fight(Trial *first, Trial *second, size_t since, int most);
  /// How two fared in all rounds from `since` on in which both ran.
  Duel compare(const Trial *first, const Trial *second, size_t since) const;
  /// The number of the last round.
  size_t getRound() const { return round; }
  int getRuns() const { return runs; }

  /// Is told what happens.
  std::function<void(const std::string &)> log;
  /// Is told which part of the budget is spent.
  std::function<void(double)> advance = [](double) {};

private:
  bool visit(Trial *trial, double *time);
  void leaveOut(Trial *trial, const std::string &why);
  void screen(Trial *text);
  void explore();
  /// The greatest improvement comes first.
  using Candidates = std::set<std::pair<double, Setting>, std::greater<>>;
  Candidates findCandidates(double best);
  std::vector<Trial *> propose(double best);
  std::set<std::array<int, 3>> findUselessValues() const;
  std::vector<Trial *> rankAllowed();
  bool isAllowed(const Trial *trial) const {
    return trial->problem.empty() && trial->error && *trial->error <= limit;
  }
  bool canRun(size_t visits) const {
    return runs + int(visits) * runsOfVisit <= budget;
  }
  void choose(Outcome &outcome);

  std::vector<Dimension> dimensions;
  Bench &bench;
  double limit;
  int budget, runs = 0, compilations = 0;
  bool isBudgetSpent = false;
  int missedChanges = 0;
  std::deque<Trial> trials;
  std::map<Setting, Trial *> bySetting;
  std::map<uint64_t, Trial *> byProgram;
  std::vector<CostModel::Observation> observations;
  CostModel model;  ///< of observations
  size_t round = 0; ///< visits of the same one are compared
};

/// How many values differ from the text's.
int countChanges(const Setting &setting);

} // namespace piko::tune

#endif // PIKO_TOOLS_PIKOTUNE_SEARCH_H
