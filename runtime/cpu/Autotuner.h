// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Autotuner.h - Which versions of its loops a kernel runs ------------===//
//
// A kernel may hold loops in two versions, as vectors and as scalar loops. The
// first units of work are a trial: each runs a candidate, which is what the
// kernel runs so far or that with one loop changed. A sequential test ends it
// as soon as the time for a unit's primitives differs by more than chance; the
// faster candidate is kept, and tried against its own neighbours. Where a trial
// ends without that, candidates have changed places from launch to launch until
// each of them has run each unit, and the sums say.
//
// What is faster depends on how much a unit has to do: units of about the same
// size, up to a factor of 4, have a choice of their own.
//
// After a trial a launch reads one number. Its time is compared with what it
// was then: if that has changed much, as for another scene, the trial is
// repeated, twice as late each time.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_AUTOTUNER_H
#define PIKO_RUNTIME_CPU_AUTOTUNER_H

#include "common/Pipeline.h"

#include <array>
#include <atomic>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

namespace piko::rt {

/// One for each thread that runs units.
struct AutotunerThread {
  size_t candidate = 0; ///< That the open unit runs.
  uint32_t round = 0;   ///< That it is of.
  uint32_t warm = 0;    ///< Of this round's candidates: those that have run.
};

class Autotuner {
public:
  /// Of a kernel's loops, by number, at least one.
  explicit Autotuner(std::span<Mapping> mappings);

  /// Before the units of a launch.
  void beginLaunch(std::span<const pikoir_unit> units);
  /// What a unit runs: pikoir_writer::mappings.
  int64_t begin(int64_t unit, AutotunerThread &thread);
  /// That a unit has ended, after so many ticks.
  void end(const pikoir_unit &unit, AutotunerThread &thread, int64_t ticks) {
    if (trying_)
      note(unit, thread, ticks);
  }
  /// After the units, which took so many ticks together.
  void endLaunch(int64_t ticks);
  /// What a launch without units of work runs.
  int64_t getCurrent() const;

private:
  /// Sums over units, of their ticks t and their weights w.
  struct Samples {
    int64_t count = 0;
    double t = 0, w = 0, tt = 0, tw = 0, ww = 0;

    void add(double ticks, double weight);
    double rate() const { return t / w; }
    /// Of the rate, from one unit to the next.
    double variance() const;
  };
  struct Candidate {
    int64_t mask = 0;
    int32_t loop = -1; ///< That is changed; -1 = the current choice.
    Samples samples;
    bool isOut = false;
  };
  /// What is known of units of one size.
  struct Class {
    int64_t mask = 0;
    bool settled = false;
    std::vector<Candidate> candidates; ///< Of a trial; the first is current.
    int32_t rounds = 0;
    int64_t launches = 0; ///< Of the round.
    double rate = 0;      ///< Of a launch once it was settled.
    int32_t drifted = 0;  ///< Launches one after the other.
    int64_t patience = 4; ///< Of them.
  };

  void note(const pikoir_unit &unit, AutotunerThread &thread, int64_t ticks);
  void startRound(Class &of, int64_t mask, int32_t known = -1);
  /// Whether the trial has said enough; of the class, with the lock.
  void judge(Class &of);
  void finishRound(Class &of, size_t best);
  void noteRatios(const Class &of);
  void checkDrift(Class &of, double rate);
  void followHost();
  void publish(int64_t mask, int32_t state);

  std::span<Mapping> mappings_;
  std::vector<MappingChoice> choices_; ///< That the classes are about.
  static constexpr size_t classCount = 8;
  std::array<Class, classCount> classes_;
  Class *class_ = nullptr;           ///< Of the open launch.
  double weight_ = 0;                ///< Of all its units.
  bool isTrial_ = false;             ///< It was one when it began.
  std::atomic<int64_t> current_ = 0; ///< What runs, outside of trials.
  std::atomic<bool> trying_ = false;
  std::mutex mutex_; ///< Of what a trial changes.
  uint32_t round_ = 0;
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_AUTOTUNER_H
