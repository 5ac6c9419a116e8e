//===- Exhaustive.h - All settings of a space -------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKOTUNE_EXHAUSTIVE_H
#define PIKO_TOOLS_PIKOTUNE_EXHAUSTIVE_H

#include "Search.h"

namespace piko::tune {

/// Rounds that each setting runs in; of piko-render's usual 35 frames half.
inline constexpr int exhaustiveRounds = 8;

/// What ran of a setting.
struct SurveyedSetting {
  Setting setting;
  double ratio = 1;          ///< its time by that of what the text says
  double error = 0;          ///< of its image
  std::vector<double> times; ///< milliseconds of each round
};

struct Survey {
  size_t settings = 0, programs = 0; ///< programs that ran, and are allowed
  int runs = 0;                      ///< to rank all of them
  Setting best = {};
  std::vector<SurveyedSetting> all = {}; ///< of what ran, the best first
  /// How much slower the chosen one is: 0.05 = 5 %. The median of rounds, and
  /// within which it is with 95 %; all 0 if it is the best.
  double regret = 0, leastRegret = 0, mostRegret = 0;
};

/// Runs all settings, in blocks with what the text says in each; then the best
/// few with `chosen`, each in several instances, as where memory lies matters.
render::Result<Survey> surveyAll(const std::vector<Dimension> &dimensions,
                                 Bench &bench, double limit,
                                 const Setting &chosen);

} // namespace piko::tune

#endif // PIKO_TOOLS_PIKOTUNE_EXHAUSTIVE_H
