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

/// The differences between all numbers of two runs, each over the largest
/// finite magnitude that its field has in the expected one. What is finite in
/// one of them only, or missing, differs by 1.
struct NumberErrors {
  double largest = 0, mean = 0;
  double rms = 0; ///< root of the mean square
  double p99 = 0; ///< 99 % of the numbers differ by at most this
};

NumberErrors measureNumbers(const Outcome &expected, const Outcome &actual);

} // namespace piko::replay

#endif // PIKO_REPLAY_MEASURE_H
