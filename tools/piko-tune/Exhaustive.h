//===- Exhaustive.h - All settings of a space -------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKOTUNE_EXHAUSTIVE_H
#define PIKO_TOOLS_PIKOTUNE_EXHAUSTIVE_H

#include "Search.h"

namespace piko::tune {

/// Rounds that each setting runs in; of piko-render's usual 35 frames half.
inline constexpr int exhaustiveRounds = 8;

struct Survey {
  size_t settings = 0, programs = 0; ///< programs that ran, and are allowed
  int runs = 0;                      ///< to rank all of them
  Setting best = {};
  /// Of what ran, the best first: its time by that of what the text says.
  std::vector<std::pair<Setting, double>> times = {};
  double regret = 0; ///< how much slower the chosen one is: 0.05 = 5 %
};

/// Runs all settings, in blocks with what the text says in each; then the best
/// few against `chosen`.
render::Result<Survey> surveyAll(const std::vector<Dimension> &dimensions,
                                 Bench &bench, double limit,
                                 const Setting &chosen);

} // namespace piko::tune

#endif // PIKO_TOOLS_PIKOTUNE_EXHAUSTIVE_H
