// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A pipeline with made-up input, which follows from the case's seed and from
// names, not from the order of declarations: integer fields are whole numbers
// from 0 to 63, floats multiples of 1/64 in [-8, 72), bytes 0 or 1. Of wide
// input that is half; the rest is any number, the special ones among them, but in
// fields whose names begin with `exact`. An integer field of the name `serial`
// numbers the primitives. Buffers that no source sizes get 64 elements, constants
// one value. Of a case with a capture the input is what that holds.

#ifndef PIKO_TEST_TOOLS_PIKO_COMPARE_RUN_H
#define PIKO_TEST_TOOLS_PIKO_COMPARE_RUN_H

#include "Options.h"
#include "Programs.h"

#include "Piko/Replay/Outcome.h"
#include "pikort/capture.h"

#include <map>
#include <mutex>
#include <set>

class Run {
public:
  Run(Program program, const Case &input);
  ~Run() { pikort_destroy(pipeline); }
  Run(const Run &) = delete;

  /// Has sources run in strips of so many primitives, or within so many bytes;
  /// 0 = not said.
  void divide(int64_t strip, int64_t budget);
  piko::replay::Outcome operator()(int threads);
  /// Writes what a run takes to a file.
  void capture(const std::string &path);

  /// Of each bin of each stage, the threads that ran a part of it.
  using Owners = std::map<std::pair<std::string, int64_t>, std::set<int32_t>>;
  /// Notes them from now on.
  void recordOwners();
  const Owners &owners() const { return threadsOf; }

private:
  void check(int32_t status);
  std::string makeRecords(int32_t record, int64_t count,
                          const std::string &who);
  void makeInput();
  void bind();

  Program program;
  const Case &input;
  pikort_pipeline *pipeline = nullptr;
  std::mutex ownersMutex;
  Owners threadsOf;
  std::map<std::string, std::string> initial, memory;
  std::optional<piko::rt::Capture> given, bound; ///< As it is read; in use.
};

#endif // PIKO_TEST_TOOLS_PIKO_COMPARE_RUN_H
