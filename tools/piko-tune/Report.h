//===- Report.h - What piko-tune says and writes ----------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKOTUNE_REPORT_H
#define PIKO_TOOLS_PIKOTUNE_REPORT_H

#include "Exhaustive.h"
#include "Space.h"

#include "Piko/Scene/Json.h"

namespace piko::tune {

/// All that there is to report.
struct TuneResult {
  const TuneOptions &options;
  const Space &space;
  /// Its size in pixels is a capture's own, whatever the options say.
  glm::ivec2 size;
  bool isCapture;
  const std::deque<Trial> &trials;
  Outcome outcome;
  std::optional<Survey> survey = {};
  /// Which versions of loops the chosen setting runs (pikort_set_mappings).
  std::string mappings = {};
};

/// For people, in lines.
std::string summarize(const TuneResult &result);

/// One line of JSON.
std::string writeJson(const TuneResult &result);

/// A line for each setting that was tried.
std::string writeCSV(const TuneResult &result);

/// The text of the file for --tuned.
std::string writeSetting(const TuneResult &result);

} // namespace piko::tune

#endif // PIKO_TOOLS_PIKOTUNE_REPORT_H
