// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How far what a run left is from what it should have: for pipelines with a
// stage that need not be strict.

#ifndef PIKO_TEST_TOOLS_PIKO_COMPARE_MEASURE_H
#define PIKO_TEST_TOOLS_PIKO_COMPARE_MEASURE_H

#include "Result.h"

#include <optional>

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

Measure measureResults(const Result &expected, const Result &actual);

#endif // PIKO_TEST_TOOLS_PIKO_COMPARE_MEASURE_H
