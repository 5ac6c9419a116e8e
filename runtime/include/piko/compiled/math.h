//===- piko/compiled/math.h - Transcendentals for the compiler ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The front end replaces calls of the C library's functions by these.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMPILED_MATH_H
#define PIKO_COMPILED_MATH_H

#include <piko/math.h>

namespace piko::detail {

/// x * 2^n, rounded once: the product is exact in double.
inline float ldexp(float x, int n) {
  n = clamp(n, -400, 400);
  double scale = fromBits(static_cast<uint64_t>(1023 + n) << 52);
  return static_cast<float>(static_cast<double>(x) * scale);
}

/// x by a mantissa in [1/2, 1) and a power of two; 0, infinity and NaN by
/// themselves and 2^0.
inline bool hasExponent(float x) {
  float size = __builtin_fabsf(x);
  return size > 0.0f && size < infinity();
}
inline int exponentOf(float x) {
  uint64_t bits = bitsOf(static_cast<double>(x)); // denormals are normal here
  return hasExponent(x) ? static_cast<int>((bits >> 52) & 2047) - 1022 : 0;
}
inline float mantissaOf(float x) { return ldexp(x, -exponentOf(x)); }

/// What trunc takes off, with the sign of x.
inline float fractionOf(float x) {
  float whole = __builtin_truncf(x);
  return __builtin_copysignf(x == whole ? 0.0f : x - whole, x);
}

inline float fdim(float x, float y) { return x <= y ? 0.0f : x - y; }

} // namespace piko::detail

#define PIKO_MATH(NAME, RESULT, PARAMETERS, VALUE)                             \
  extern "C" [[gnu::used]] inline RESULT __piko_math_##NAME PARAMETERS {       \
    return VALUE;                                                              \
  }
#define PIKO_MATH_1(NAME) PIKO_MATH(NAME, float, (float x), ::piko::NAME(x))
#define PIKO_MATH_2(NAME)                                                      \
  PIKO_MATH(NAME, float, (float x, float y), ::piko::NAME(x, y))
PIKO_MATH_1(exp)
PIKO_MATH_1(exp2)
PIKO_MATH_1(log)
PIKO_MATH_1(log2)
PIKO_MATH_1(log10)
PIKO_MATH_1(sin)
PIKO_MATH_1(cos)
PIKO_MATH_1(tan)
PIKO_MATH_1(asin)
PIKO_MATH_1(acos)
PIKO_MATH_1(atan)
PIKO_MATH_1(sinh)
PIKO_MATH_1(cosh)
PIKO_MATH_1(tanh)
PIKO_MATH_1(cbrt)
PIKO_MATH_2(pow)
PIKO_MATH_2(atan2)
PIKO_MATH_2(hypot)

PIKO_MATH(fdim, float, (float x, float y), ::piko::detail::fdim(x, y))
PIKO_MATH(ldexp, float, (float x, int n), ::piko::detail::ldexp(x, n))
PIKO_MATH(lrint, int64_t, (float x), ::piko::toInt64(::piko::round(x)))
PIKO_MATH(llrint, int64_t, (float x), ::piko::toInt64(::piko::round(x)))
PIKO_MATH(lround, int64_t, (float x), ::piko::toInt64(__builtin_roundf(x)))
PIKO_MATH(llround, int64_t, (float x), ::piko::toInt64(__builtin_roundf(x)))
// Functions with two results, one by one.
PIKO_MATH(frexp0, float, (float x), ::piko::detail::mantissaOf(x))
PIKO_MATH(frexp1, int, (float x), ::piko::detail::exponentOf(x))
PIKO_MATH(modf0, float, (float x), ::piko::detail::fractionOf(x))
PIKO_MATH(modf1, float, (float x), __builtin_truncf(x))
#undef PIKO_MATH_1
#undef PIKO_MATH_2
#undef PIKO_MATH

#endif // PIKO_COMPILED_MATH_H
