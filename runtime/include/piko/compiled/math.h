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

/// The same of doubles, where no wider type holds the product: up to two exact
/// steps, which stay away from what is denormal, leave an exponent in range.
inline int exactStep(int n) { return n > 1023 ? 1023 : n < -1022 ? -969 : 0; }
inline double powerOfTwo(int n) {
  return fromBits(static_cast<uint64_t>(1023 + n) << 52);
}
inline double ldexp(double x, int n) {
  int first = exactStep(n), second = exactStep(n - first);
  int rest = clamp(n - first - second, -1022, 1023);
  return x * powerOfTwo(first) * powerOfTwo(second) * powerOfTwo(rest);
}
inline bool hasExponent(double x) {
  double size = __builtin_fabs(x);
  return size > 0.0 && size < __builtin_inf();
}
inline bool isDenormal(double x) { return __builtin_fabs(x) < 0x1p-1022; }
inline double makeNormal(double x) { return isDenormal(x) ? x * 0x1p54 : x; }
inline int exponentOf(double x) {
  int scaled = isDenormal(x) ? 54 : 0;
  int exponent = static_cast<int>((bitsOf(makeNormal(x)) >> 52) & 2047);
  return hasExponent(x) ? exponent - 1022 - scaled : 0;
}
inline double mantissaOf(double x) {
  uint64_t bits = bitsOf(makeNormal(x)) & ~(uint64_t(2047) << 52);
  return hasExponent(x) ? fromBits(bits | uint64_t(1022) << 52) : x;
}
inline double fractionOf(double x) {
  double whole = __builtin_trunc(x);
  return __builtin_copysign(x == whole ? 0.0 : x - whole, x);
}
inline double fdim(double x, double y) { return x <= y ? 0.0 : x - y; }

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

// Of floats and of doubles. A cast to an integer saturates here.
#define PIKO_MATH_EXACT(TYPE, SUFFIX, ROUND, ROUND_EVEN, TRUNC)                \
  PIKO_MATH(fdim##SUFFIX, TYPE, (TYPE x, TYPE y), ::piko::detail::fdim(x, y))  \
  PIKO_MATH(ldexp##SUFFIX, TYPE, (TYPE x, int n), ::piko::detail::ldexp(x, n)) \
  PIKO_MATH(lrint##SUFFIX, int64_t, (TYPE x),                                  \
            static_cast<int64_t>(ROUND_EVEN(x)))                               \
  PIKO_MATH(llrint##SUFFIX, int64_t, (TYPE x),                                 \
            static_cast<int64_t>(ROUND_EVEN(x)))                               \
  PIKO_MATH(lround##SUFFIX, int64_t, (TYPE x), static_cast<int64_t>(ROUND(x))) \
  PIKO_MATH(llround##SUFFIX, int64_t, (TYPE x),                                \
            static_cast<int64_t>(ROUND(x)))                                    \
  /* Functions with two results, one by one. */                                \
  PIKO_MATH(frexp0##SUFFIX, TYPE, (TYPE x), ::piko::detail::mantissaOf(x))     \
  PIKO_MATH(frexp1##SUFFIX, int, (TYPE x), ::piko::detail::exponentOf(x))      \
  PIKO_MATH(modf0##SUFFIX, TYPE, (TYPE x), ::piko::detail::fractionOf(x))      \
  PIKO_MATH(modf1##SUFFIX, TYPE, (TYPE x), TRUNC(x))
PIKO_MATH_EXACT(float, , __builtin_roundf, __builtin_roundevenf,
                __builtin_truncf)
PIKO_MATH_EXACT(double, _double, __builtin_round, __builtin_roundeven,
                __builtin_trunc)
#undef PIKO_MATH_EXACT
#undef PIKO_MATH_1
#undef PIKO_MATH_2
#undef PIKO_MATH

#endif // PIKO_COMPILED_MATH_H
