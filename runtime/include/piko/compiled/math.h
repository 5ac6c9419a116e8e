//===- piko/compiled/math.h - Transcendentals for the compiler ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The front end replaces calls of the C library's functions by these.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMPILED_MATH_H
#define PIKO_COMPILED_MATH_H

#include <piko/math.h>

#define PIKO_MATH_1(NAME)                                                      \
  extern "C" [[gnu::used]] inline float __piko_math_##NAME(float x) {          \
    return ::piko::NAME(x);                                                    \
  }
#define PIKO_MATH_2(NAME)                                                      \
  extern "C" [[gnu::used]] inline float __piko_math_##NAME(float x, float y) { \
    return ::piko::NAME(x, y);                                                 \
  }
PIKO_MATH_1(exp)
PIKO_MATH_1(exp2)
PIKO_MATH_1(log)
PIKO_MATH_1(log2)
PIKO_MATH_1(sin)
PIKO_MATH_1(cos)
PIKO_MATH_1(tan)
PIKO_MATH_1(asin)
PIKO_MATH_1(acos)
PIKO_MATH_1(atan)
PIKO_MATH_1(cbrt)
PIKO_MATH_2(pow)
PIKO_MATH_2(atan2)
#undef PIKO_MATH_1
#undef PIKO_MATH_2

#endif // PIKO_COMPILED_MATH_H
