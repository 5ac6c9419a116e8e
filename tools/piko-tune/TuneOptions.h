//===- TuneOptions.h - The command line of piko-tune ------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKOTUNE_TUNEOPTIONS_H
#define PIKO_TOOLS_PIKOTUNE_TUNEOPTIONS_H

#include "Options.h"

#include <set>
#include <string>
#include <vector>

namespace piko::tune {

/// How images are compared, as piko-diff does.
enum class Metric { Max, Mean, RMS, P99, FLIP };

struct TuneOptions {
  std::string help;               ///< the text, if that is asked for
  render::Options render;         ///< the file, the scene, and how it is seen
  std::vector<std::string> pipes; ///< to choose from; empty = the only one
  std::string errorText = "1/255";
  double error = 1.0 / 255;
  Metric metric = Metric::Max;
  std::string metricName = "max";
  std::string reference; ///< an image; empty = what the text gives
  /// Groups, and names of passes.
  std::set<std::string> space = {"tunables", "schedules", "lanes", "numbers",
                                 "passes"};
  int budget = 500;
  bool countsCPU = false; ///< the time of processors instead of the time
  bool exhaustive = false, json = false;
  std::string out, chart, csv; ///< files to write
};

/// Reads the command line, without the program's name.
render::Result<TuneOptions>
parseTuneOptions(const std::vector<std::string> &words);

} // namespace piko::tune

#endif // PIKO_TOOLS_PIKOTUNE_TUNEOPTIONS_H
