//===- piko/reference/check.h - Is arithmetic what it has to be? ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A build may contract a * b + c or flush denormals without a macro that says
// so; each run checks.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_CHECK_H
#define PIKO_REFERENCE_CHECK_H

#include <piko/reference/error.h>

namespace piko::reference {

static inline void checkArithmetic() {
  // (1 + e)^2 - (1 + 2e) is e^2 when contracted, and 0 when the product is
  // rounded first.
  volatile float factor = 1.0f + 0x1p-13f, subtrahend = -(1.0f + 0x1p-12f);
  float a = factor, b = factor, c = subtrahend;
  volatile float sum = a * b + c;
  if (sum != 0.0f)
    throw Error("this program contracts a * b + c; build it with "
                "-ffp-contract=off");
  volatile float one = 1.0f, large = 0x1p30f;
  float first = one, added = large;
  volatile float difference = (first + added) - added;
  if (difference != 0.0f)
    throw Error("this program reorders sums; build it without -ffast-math and "
                "its parts");
}

} // namespace piko::reference

#endif // PIKO_REFERENCE_CHECK_H
