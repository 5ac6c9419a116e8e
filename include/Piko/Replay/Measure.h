// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How far what a run left is from what it should have: for pipelines with a
// stage that need not be strict.

#ifndef PIKO_REPLAY_MEASURE_H
#define PIKO_REPLAY_MEASURE_H

#include "Piko/Replay/Outcome.h"

namespace piko::replay {

/// What two runs that did not stop left; two NaNs are equal.
struct Measure {
  std::vector<std::string> lines; ///< one for each field that differs
  double relative = 0;            ///< the largest difference of finite numbers
  /// Whether an integer differs, a number is finite in one of them only, or a
  /// piece of state is missing or of another size.
  bool differsInKind = false;

  bool isWithin(double tolerance) const {
    return !differsInKind && relative <= tolerance;
  }
};

Measure measureOutcomes(const Outcome &expected, const Outcome &actual);

} // namespace piko::replay

#endif // PIKO_REPLAY_MEASURE_H
