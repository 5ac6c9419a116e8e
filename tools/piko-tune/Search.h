//===- Search.h - The fastest of many settings ------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A setting has a value in each dimension. Most products of values are never
// run:
//
//   1. The pipelines race as the text has them; the best two stay.
//   2. Each change of one value of these joins them. Successive halving: all
//      run once, with a small image, and those that would go once more; of
//      many, half go, and the others go on with a full image, and run twice as
//      often each time that half of them has gone. Of few all but three go.
//   3. Changes that were good alone are tried together, against the best so
//      far. From the winner on, 2 again, until nothing better is found.
//   4. The winner meets the runner-up and what the text says, in turn, until a
//      sign test is sure.
//
// Who is compared runs in turn, so that a machine which is slower for a while
// is so for all. A setting whose error is too large is left out when its first
// full image is there.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_PIKOTUNE_SEARCH_H
#define PIKO_TOOLS_PIKOTUNE_SEARCH_H

#include "Piko/Scene/Result.h"

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
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

/// The number of a value in each dimension. Those of other pipelines are 0.
using Setting = std::vector<int>;

/// All settings of a space, in order; nothing if they are more than `most`.
std::optional<std::vector<Setting>>
enumerateSettings(const std::vector<Dimension> &dimensions, size_t most);

enum class Scale { Small, Full };

/// Where settings run.
class Bench {
public:
  virtual ~Bench() = default;
  /// Compiles a setting. Those with the same number run the same program.
  virtual render::Result<uint64_t> prepare(const Setting &setting) = 0;
  /// Runs two frames: the milliseconds of the faster one.
  virtual render::Result<double> visit(const Setting &setting, Scale scale) = 0;
  /// How far the last full image is from what it should be.
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
  std::vector<double> small = {}, full = {}; ///< milliseconds
  std::optional<double> error = {};
  std::string problem = {}; ///< why it is left out; empty if it is not
  /// Of its last race: the logarithm of its time.
  double score = 0;

  /// Of full images; 0 where there is none.
  double median() const;
};

/// How one setting fared against another one, in turn.
struct Duel {
  int wins = 0, rounds = 0; ///< of the first
  double ratio = 1;         ///< median time of the second, of the first's

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
  void race(std::vector<Trial *> &pool, Scale scale, int rounds);
  /// Ends when a sign test is sure, after `most` rounds, or with the budget.
  Duel fight(Trial *first, Trial *second, int most);
  int getRuns() const { return runs; }
  void setBudget(int most) { budget = most; }

  /// Is told what happens.
  std::function<void(const std::string &)> log;

private:
  bool visit(Trial *trial, Scale scale, double *time);
  void leaveOut(Trial *trial, const std::string &why);
  void rank(std::vector<Trial *> &pool);
  void giveSecondChance(std::vector<Trial *> &pool, size_t next, Scale scale);
  void halve(std::vector<Trial *> &pool, size_t keep);
  std::vector<Trial *> findBases(Trial *text);
  void addChanges(Trial *base, std::vector<Trial *> &pool);
  void addCombinations(const std::vector<Trial *> &bases,
                       std::vector<Trial *> &pool);
  bool isHopeless(const Setting &setting, const Setting &base) const;
  std::vector<Trial *> improve(Trial *text);
  bool isAllowed(const Trial *trial) const {
    return trial->problem.empty() && trial->error && *trial->error <= limit;
  }
  /// Whether no full image has shown that it is not.
  bool mayBeAllowed(const Trial &trial) const {
    return trial.problem.empty() && (!trial.error || *trial.error <= limit);
  }
  void choose(std::vector<Trial *> ranking, Outcome &outcome);

  std::vector<Dimension> dimensions;
  Bench &bench;
  double limit;
  int budget, runs = 0, compilations = 0;
  bool isBudgetSpent = false;
  std::deque<Trial> trials;
  std::map<Setting, Trial *> bySetting;
  std::map<uint64_t, Trial *> byProgram;
  /// How much faster the first was than the second when they last ran in one
  /// race, as a logarithm.
  std::map<std::pair<size_t, size_t>, double> gains; // by number
};

/// How many values differ from the text's.
int countChanges(const Setting &setting);

} // namespace piko::tune

#endif // PIKO_TOOLS_PIKOTUNE_SEARCH_H
