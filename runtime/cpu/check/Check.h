// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Check.h - Checking mode --------------------------------------------===//
//
// What a checked program says of itself as it runs, on one thread: calls,
// emissions, accesses to state, iterations and barriers. Calls and emissions
// are kept for the whole run, because lineages are chains through them; of each
// element of state the first and the last access of each kind and stage, which
// are enough to meet any conflict. docs/Diagnostics.md has the rules.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_CHECK_H
#define PIKO_RUNTIME_CPU_CHECK_H

#include "cpu/CPUExecutor.h"

#include <unordered_map>

namespace piko::rt {

/// Which stages are done before others begin.
class StageRelation {
public:
  explicit StageRelation(const pikort_pipeline &p);

  /// Whether two calls may run at the same time. A turn is a run of a
  /// collecting stage.
  bool areConcurrent(int32_t x, int64_t turnOfX, int32_t y,
                     int64_t turnOfY) const;

private:
  using Set = std::vector<bool>; ///< Of stages.

  void findReachable();
  void addFinished(size_t stage, Set &set) const;
  void findDone();
  bool shareCycle(size_t x, size_t y) const {
    return x == y || (reaches[x][y] && reaches[y][x]);
  }

  const pikort_pipeline &p;
  std::vector<std::vector<size_t>> producers, waits; ///< Of each stage.
  std::vector<Set> reaches, done;
  Set inRounds; ///< On a cycle through a collecting stage.
};

/// What runs in sequence: a call, or an iteration of it between two barriers.
struct Strand {
  int32_t outer = -1; ///< In the call's strands; -1 for the call itself.
  int64_t loop = -1, interval = 0, iteration = -1;
};

/// A call of Process.
struct CheckedCall {
  int32_t stage;
  int64_t bin;
  int64_t parent; ///< The lineage of its primitive.
  int64_t number; ///< Where the stage collects: among the calls for the bin.
  int64_t turn;
};

struct Emission {
  int64_t call, ordinal;
};

struct Access {
  int32_t kind; ///< pikoir_check_access
  int32_t strand;
  int64_t call;
  const char *place;
};

class Checker {
public:
  explicit Checker(pikort_pipeline &p) : p(p) {}

  // --- setup: what is declared
  struct Number {
    int32_t record;
    std::string field;
  };
  std::vector<Number> numbers;

  // --- a run
  /// Gives the primitives of sources their lineage; throws.
  void beginRun();
  void endRun();
  void beginStage(int32_t stage);
  void endStage() { flushReads(); }

  void beginCall(int32_t stage, int64_t bin, int64_t lineage);
  void assign(int32_t stage, int64_t lineage);
  int64_t emit();
  void at(const char *newPlace) { place = newPlace; }
  void access(int32_t state, int32_t kind, const int64_t (&index)[4]);
  void loop(int32_t event, int64_t iteration);
  void wrongIndex(int64_t index, int64_t size);
  bool trip(const char *at) {
    if (!failed &&
        ++(assignStage >= 0 ? assignTrips : trips) > PIKOIR_MOST_TRIPS)
      endless(at);
    return !failed;
  }
  void wrongValue(int32_t kind, int32_t record, const char *field);

  // --- errors
  /// The first error of the run was found now.
  void noteError();
  /// The lineage of a primitive that a stage takes, as the end of a message.
  std::string contextOf(const Stage &stage, const uint8_t *record) const;
  /// The message of an error that is `plain` without checking.
  std::string describe(int32_t code, const std::string &plain) const;

private:
  struct LoopState {
    int64_t number;
    int32_t strand; ///< Around it.
    size_t firstEmission;
    std::unordered_map<int64_t, int64_t> intervals; ///< Of each iteration.
    std::vector<int64_t> emitters; ///< The iteration of each emission.
  };
  struct PendingRead {
    uint64_t element;
    Access access;
  };

  // CheckShadow.cpp
  void record(uint64_t element, const Access &access);
  bool conflict(const Access &a, const Access &b) const;
  bool areConcurrent(const Access &a, const Access &b) const;
  std::pair<int64_t, int64_t> iterations(int32_t a, int32_t b) const;
  std::vector<int32_t> path(int32_t strand) const;
  void failConflict(uint64_t element, const Access &access,
                    const Access &other);
  std::string elementText(uint64_t element) const;
  bool updatesPixel(uint64_t element) const;
  void flushReads();

  // Check.cpp
  void copySource(int32_t source);
  void testNumbers(int32_t source, const uint8_t *primitive, int64_t index);
  void enter(int64_t iteration);
  void numberEmissions(const LoopState &loop);
  void fail(int32_t stage, const std::string &text);
  void endless(const char *at);
  void report(int32_t code, int64_t a, int64_t b);
  int32_t currentStage() const {
    return assignStage >= 0 ? assignStage : calls.back().stage;
  }
  std::string header() const;
  std::string context(const char *at, int64_t call,
                      const std::string &prefix) const;
  std::string currentContext() const;
  std::string lineageText(int64_t lineage) const;
  std::string callText(int64_t call) const;
  std::string hopText(const Emission &emission) const;

  pikort_pipeline &p;
  std::unique_ptr<StageRelation> relation;
  std::vector<Array<uint8_t>> copies;       ///< Of sources.
  std::vector<const uint8_t *> hostSources; ///< What the host bound.

  std::vector<CheckedCall> calls; ///< The last one is running.
  std::vector<Emission> emissions;
  std::unordered_map<int64_t, int64_t> callsOfBin; ///< Of the stage.
  int64_t turn = 0, ordinal = 0, loopCount = 0;
  int64_t trips = 0, assignTrips = 0; ///< Of all loops of the call.
  const char *place = nullptr;
  int32_t assignStage = -1; ///< Whose AssignBin runs; -1 = none.
  int64_t assignLineage = 0;

  std::vector<Strand> strands;  ///< Of the call.
  std::vector<LoopState> loops; ///< The innermost last.
  int32_t strand = 0;
  std::vector<PendingRead> reads;
  std::unordered_map<uint64_t, std::vector<Access>> shadow;

  bool failed = false;
  std::string finding, errorContext;
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_CHECK_H
