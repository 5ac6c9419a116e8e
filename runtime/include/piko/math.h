//===- piko/math.h - Functions with the same bits everywhere --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The functions of piko:: on float, as plain C++ over + - * / and sqrt, which
// IEEE 754 rounds correctly on every machine. No libm is called, so a
// pipeline computes the same bits in the reference executor and on every
// target. Inside, they compute in double, which keeps each within a stated
// number of units in the last place (ULP) of the exact result; the bound holds
// for all arguments and is verified by
// unittests/Language/MathBoundTest.cpp.
//
// Special cases (infinities, NaN, signed zeros) follow IEEE 754 and C.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_MATH_H
#define PIKO_MATH_H

#include <piko/macros_begin.h>

#include <stdint.h>

#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif

namespace piko {
namespace detail {

inline uint64_t bitsOf(double x) { return __builtin_bit_cast(uint64_t, x); }
inline double fromBits(uint64_t b) { return __builtin_bit_cast(double, b); }
inline bool isNegative(float x) {
  return __builtin_bit_cast(uint32_t, x) >> 31;
}
inline float infinity() { return __builtin_inff(); }
inline float quietNaN() { return __builtin_bit_cast(float, 0x7fc00000u); }

constexpr double halfPi = 0x1.921fb54442d18p+0;
constexpr double pi = 0x1.921fb54442d18p+1;
constexpr double ln2 = 0x1.62e42fefa39efp-1;
constexpr double log2e = 0x1.71547652b82fep+0;
constexpr double log10e = 0x1.bcb7b1526e50ep-2;
constexpr double log10of2 = 0x1.34413509f79ffp-2;

/// 2^x by 2^k 2^r with |r| <= 1/2 and the power series of 2^r, whose first
/// term left out is below 8e-12.
inline double exp2(double x) {
  constexpr double toInteger = 0x1.8p52; // adding it leaves an integer
  x = x < -1000.0 ? -1000.0 : x;
  x = x > 1000.0 ? 1000.0 : x;
  double shifted = x + toInteger;
  double r = x - (shifted - toInteger);
  double p = 0x1.b5253d395e7c4p-24;
  p = p * r + 0x1.62c0223a5c824p-20;
  p = p * r + 0x1.ffcbfc588b0c7p-17;
  p = p * r + 0x1.430912f86c787p-13;
  p = p * r + 0x1.5d87fe78a6731p-10;
  p = p * r + 0x1.3b2ab6fba4e77p-7;
  p = p * r + 0x1.c6b08d704a0c0p-5;
  p = p * r + 0x1.ebfbdff82c58fp-3;
  p = p * r + 0x1.62e42fefa39efp-1;
  p = p * r + 1.0;
  return p * fromBits((bitsOf(shifted) + 1023) << 52);
}

/// The natural logarithm of a normal x > 0 in two parts: an exponent e (as a
/// double) and the logarithm of a mantissa in [sqrt(1/2), sqrt(2)], by the
/// series of the inverse hyperbolic tangent.
struct Logarithm {
  double exponent, mantissa;
};
inline Logarithm logOf(double x) {
  uint64_t bits = bitsOf(x);
  int64_t e = static_cast<int64_t>(bits >> 52) - 1023;
  double m = fromBits((bits & 0xfffffffffffffull) | 0x3ff0000000000000ull);
  if (m > 0x1.6a09e667f3bcdp+0) {
    m *= 0.5;
    e += 1;
  }
  double s = (m - 1.0) / (m + 1.0);
  double z = s * s;
  double p = 1.0 / 19.0;
  p = p * z + 1.0 / 17.0;
  p = p * z + 1.0 / 15.0;
  p = p * z + 1.0 / 13.0;
  p = p * z + 1.0 / 11.0;
  p = p * z + 1.0 / 9.0;
  p = p * z + 1.0 / 7.0;
  p = p * z + 1.0 / 5.0;
  p = p * z + 1.0 / 3.0;
  p = p * z + 1.0;
  return {static_cast<double>(static_cast<int32_t>(e)), 2.0 * s * p};
}

/// x - k pi/2 for the nearest integer k, and the last bits of k.
struct Angle {
  double rest;
  uint32_t quadrant;
};
/// For |x| < 2^25. pi/2 is split in 27, 27 and 53 bits, so that the products
/// with k, which has at most 26 bits, and the first two differences are exact.
inline Angle reduceSmall(double x) {
  constexpr double toInteger = 0x1.8p52;
  double shifted = x * 0x1.45f306dc9c883p-1 + toInteger;
  double k = shifted - toInteger;
  double rest = ((x - k * 0x1.921fb54p+0) - k * 0x1.10b461p-30) -
                k * 0x1.a62633145c06ep-58;
  return {rest, static_cast<uint32_t>(bitsOf(shifted))};
}
/// For finite |x| >= 2^25: multiplies the 24-bit mantissa by those 96 bits of
/// 2/pi that matter modulo 4 (Payne and Hanek).
inline Angle reduceLarge(float x) {
  uint32_t bits = __builtin_bit_cast(uint32_t, x);
  uint64_t m = (bits & 0x7fffffu) | 0x800000u;
  uint32_t skipped = ((bits >> 23) & 255) - 152; // bits of 2/pi to leave out
  uint32_t word = skipped >> 5, shift = skipped & 31;
  // Four of the words of 2/pi.
  uint64_t a, b, c, d;
  if (word == 0) {
    a = 0xa2f9836e, b = 0x4e441529, c = 0xfc2757d1, d = 0xf534ddc0;
  } else if (word == 1) {
    a = 0x4e441529, b = 0xfc2757d1, c = 0xf534ddc0, d = 0xdb629599;
  } else if (word == 2) {
    a = 0xfc2757d1, b = 0xf534ddc0, c = 0xdb629599, d = 0x3c439041;
  } else {
    a = 0xf534ddc0, b = 0xdb629599, c = 0x3c439041, d = 0xfe5163ab;
  }
  uint64_t w0 = ((a << 32 | b) << shift) >> 32;
  uint64_t w1 = ((b << 32 | c) << shift) >> 32;
  uint64_t w2 = ((c << 32 | d) << shift) >> 32;
  // |x| 2/pi modulo 4, in units of 2^-62.
  uint64_t turns = (m * w0 << 32) + m * w1 + (m * w2 >> 32);
  uint64_t k = (turns + (uint64_t(1) << 61)) >> 62;
  double rest = static_cast<double>(static_cast<int64_t>(turns - (k << 62))) *
                (halfPi * 0x1p-62);
  uint32_t quadrant = static_cast<uint32_t>(k);
  return isNegative(x) ? Angle{-rest, 0u - quadrant} : Angle{rest, quadrant};
}
inline Angle reduce(float x) {
  float size = __builtin_fabsf(x);
  if (size < 0x1p25f)
    return reduceSmall(x);
  if (size < infinity())
    return reduceLarge(x);
  return {static_cast<double>(quietNaN()), 0};
}

/// Power series for |r| <= pi/4.
inline double sinOf(double r) {
  double z = r * r;
  double p = 1.0 / 6227020800.0;
  p = p * z - 1.0 / 39916800.0;
  p = p * z + 1.0 / 362880.0;
  p = p * z - 1.0 / 5040.0;
  p = p * z + 1.0 / 120.0;
  p = p * z - 1.0 / 6.0;
  return r * (p * z + 1.0);
}
inline double cosOf(double r) {
  double z = r * r;
  double p = -1.0 / 87178291200.0;
  p = p * z + 1.0 / 479001600.0;
  p = p * z - 1.0 / 3628800.0;
  p = p * z + 1.0 / 40320.0;
  p = p * z - 1.0 / 720.0;
  p = p * z + 1.0 / 24.0;
  p = p * z - 1.0 / 2.0;
  return p * z + 1.0;
}
/// The sine of an angle plus `quarters` quarter turns.
inline double sinOf(Angle angle, uint32_t quarters) {
  uint32_t quadrant = angle.quadrant + quarters;
  double value = quadrant & 1 ? cosOf(angle.rest) : sinOf(angle.rest);
  return quadrant & 2 ? -value : value;
}

/// The hyperbolic sine and cosine: by exponentials, and the sine from its power
/// series where those cancel.
inline double sinhOf(double x) {
  if (x > -1.0 && x < 1.0) {
    double z = x * x;
    double p = 1.0 / 1307674368000.0;
    p = p * z + 1.0 / 6227020800.0;
    p = p * z + 1.0 / 39916800.0;
    p = p * z + 1.0 / 362880.0;
    p = p * z + 1.0 / 5040.0;
    p = p * z + 1.0 / 120.0;
    p = p * z + 1.0 / 6.0;
    return x * (p * z + 1.0);
  }
  double power = exp2(x * log2e);
  return 0.5 * (power - 1.0 / power);
}
inline double coshOf(double x) {
  double power = exp2(x * log2e);
  return 0.5 * (power + 1.0 / power);
}

/// The arc tangent of x >= 0, from [0, tan(pi/8)] by its power series.
inline double atanOf(double x) {
  bool inverted = x > 1.0;
  double t = inverted ? 1.0 / x : x;
  bool turned = t > 0x1.a827999fcef32p-2;
  t = turned ? (t - 1.0) / (t + 1.0) : t;
  double z = t * t;
  double p = 1.0 / 25.0;
  p = p * z - 1.0 / 23.0;
  p = p * z + 1.0 / 21.0;
  p = p * z - 1.0 / 19.0;
  p = p * z + 1.0 / 17.0;
  p = p * z - 1.0 / 15.0;
  p = p * z + 1.0 / 13.0;
  p = p * z - 1.0 / 11.0;
  p = p * z + 1.0 / 9.0;
  p = p * z - 1.0 / 7.0;
  p = p * z + 1.0 / 5.0;
  p = p * z - 1.0 / 3.0;
  double angle = t * (p * z + 1.0);
  angle = turned ? halfPi * 0.5 + angle : angle;
  return inverted ? halfPi - angle : angle;
}

} // namespace detail

/// The lesser of two values: b < a ? b : a, also for NaN.
template <class T> inline T min(T a, T b) { return b < a ? b : a; }
/// The greater of two values: a < b ? b : a, also for NaN.
template <class T> inline T max(T a, T b) { return a < b ? b : a; }
/// min(max(x, lo), hi).
template <class T> inline T clamp(T x, T lo, T hi) {
  return min(max(x, lo), hi);
}

inline float abs(float x) { return __builtin_fabsf(x); }
/// The absolute value; the least integer is its own.
inline int32_t abs(int32_t x) {
  return x < 0 ? static_cast<int32_t>(0u - static_cast<uint32_t>(x)) : x;
}
inline int64_t abs(int64_t x) {
  return x < 0 ? static_cast<int64_t>(uint64_t(0) - static_cast<uint64_t>(x))
               : x;
}

// Exact.
inline float floor(float x) { return __builtin_floorf(x); }
inline float ceil(float x) { return __builtin_ceilf(x); }
inline float trunc(float x) { return __builtin_truncf(x); }
inline float copysign(float x, float sign) {
  return __builtin_copysignf(x, sign);
}
/// The nearest integer, halves to the even one.
inline float round(float x) {
  float size = __builtin_fabsf(x);
  float rounded = (size + 0x1p23f) - 0x1p23f;
  return size < 0x1p23f ? __builtin_copysignf(rounded, x) : x;
}

/// The integer part, saturated; 0 for NaN.
inline int32_t toInt(float x) {
  if (!(x > -2147483648.0f))
    return x != x ? 0 : INT32_MIN;
  return x >= 2147483648.0f ? INT32_MAX : static_cast<int32_t>(x);
}
inline int64_t toInt64(float x) {
  if (!(x > -9223372036854775808.0f))
    return x != x ? 0 : INT64_MIN;
  return x >= 9223372036854775808.0f ? INT64_MAX : static_cast<int64_t>(x);
}
inline uint32_t toUint(float x) {
  if (!(x > 0.0f))
    return 0;
  return x >= 4294967296.0f ? UINT32_MAX : static_cast<uint32_t>(x);
}

/// Correctly rounded.
inline float sqrt(float x) { return __builtin_sqrtf(x); }

/// a * b + c, rounded once. Correctly rounded.
inline float fma(float a, float b, float c) {
#if defined(__PIKO__) || defined(__FMA__)
  return __builtin_fmaf(a, b, c);
#else
  // The product is exact in double. The sum is rounded to odd, so that
  // rounding it again, to float, is as good as rounding once.
  double product = static_cast<double>(a) * static_cast<double>(b);
  double addend = c;
  double sum = product + addend;
  double part = sum - product;
  double error = (product - (sum - part)) + (addend - part);
  if (error < 0.0 || error > 0.0) {
    uint64_t bits = detail::bitsOf(sum);
    if ((bits & 1) == 0)
      sum =
          detail::fromBits((error > 0.0) == (sum > 0.0) ? bits + 1 : bits - 1);
  }
  return static_cast<float>(sum);
#endif
}

/// 1 / sqrt(x). Within 0.501 ULP.
inline float rsqrt(float x) {
  return static_cast<float>(1.0 / __builtin_sqrt(static_cast<double>(x)));
}

/// The square root of x * x + y * y; infinite if x or y is. Within 0.501 ULP.
inline float hypot(float x, float y) {
  float width = __builtin_fabsf(x), height = __builtin_fabsf(y);
  if (width == detail::infinity() || height == detail::infinity())
    return detail::infinity();
  double a = x, b = y;
  return static_cast<float>(__builtin_sqrt(a * a + b * b));
}

/// The cube root. Within 0.501 ULP.
inline float cbrt(float x) {
  float size = __builtin_fabsf(x);
  if (!(size > 0.0f && size < detail::infinity()))
    return x;
  double a = size;
  // A third of the exponent; then each step of Newton's squares the error.
  double y = detail::fromBits(detail::bitsOf(a) / 3 + (uint64_t(682) << 52) -
                              0x879400000000);
  y = y - (y * y * y - a) / (3.0 * y * y);
  y = y - (y * y * y - a) / (3.0 * y * y);
  y = y - (y * y * y - a) / (3.0 * y * y);
  return __builtin_copysignf(static_cast<float>(y), x);
}

/// 2 to the power x. Within 0.501 ULP.
inline float exp2(float x) { return static_cast<float>(detail::exp2(x)); }
/// e to the power x. Within 0.501 ULP.
inline float exp(float x) {
  return static_cast<float>(detail::exp2(x * detail::log2e));
}

namespace detail {
/// What all logarithms give where they are not finite.
inline float logOutside(float x) {
  if (x == 0.0f)
    return -infinity();
  return x > 0.0f ? x : quietNaN();
}
} // namespace detail

/// The natural logarithm. Within 0.501 ULP.
inline float log(float x) {
  if (!(x > 0.0f && x < detail::infinity()))
    return detail::logOutside(x);
  detail::Logarithm l = detail::logOf(x);
  return static_cast<float>(l.exponent * detail::ln2 + l.mantissa);
}
/// The logarithm to base 2. Within 0.501 ULP.
inline float log2(float x) {
  if (!(x > 0.0f && x < detail::infinity()))
    return detail::logOutside(x);
  detail::Logarithm l = detail::logOf(x);
  return static_cast<float>(l.exponent + l.mantissa * detail::log2e);
}

/// The logarithm to base 10. Within 0.501 ULP.
inline float log10(float x) {
  if (!(x > 0.0f && x < detail::infinity()))
    return detail::logOutside(x);
  detail::Logarithm l = detail::logOf(x);
  return static_cast<float>(l.exponent * detail::log10of2 +
                            l.mantissa * detail::log10e);
}

/// x to the power y. Within 0.501 ULP.
inline float pow(float x, float y) {
  if (y == 0.0f || x == 1.0f)
    return 1.0f;
  if (x != x || y != y)
    return detail::quietNaN();
  float size = __builtin_fabsf(x);
  bool integral = __builtin_floorf(y) == y;
  if (x < 0.0f && size < detail::infinity() && !integral)
    return detail::quietNaN();
  double log2OfSize;
  if (size > 0.0f && size < detail::infinity()) {
    detail::Logarithm l = detail::logOf(size);
    log2OfSize = l.exponent + l.mantissa * detail::log2e;
  } else {
    log2OfSize = detail::logOutside(size);
  }
  double value = size == 1.0f ? 1.0 : detail::exp2(y * log2OfSize);
  bool odd = integral && __builtin_fabsf(y) < 0x1p24f &&
             (static_cast<int32_t>(y) & 1) != 0;
  float result = static_cast<float>(value);
  return odd && detail::isNegative(x) ? -result : result;
}

/// The sine of an angle in radians. Within 0.501 ULP.
inline float sin(float x) {
  return static_cast<float>(detail::sinOf(detail::reduce(x), 0));
}
/// The cosine of an angle in radians. Within 0.501 ULP.
inline float cos(float x) {
  return static_cast<float>(detail::sinOf(detail::reduce(x), 1));
}
/// The tangent of an angle in radians. Within 0.501 ULP.
inline float tan(float x) {
  detail::Angle angle = detail::reduce(x);
  double s = detail::sinOf(angle.rest), c = detail::cosOf(angle.rest);
  return static_cast<float>(angle.quadrant & 1 ? -c / s : s / c);
}

/// The hyperbolic sine. Within 0.501 ULP.
inline float sinh(float x) { return static_cast<float>(detail::sinhOf(x)); }
/// The hyperbolic cosine. Within 0.501 ULP.
inline float cosh(float x) { return static_cast<float>(detail::coshOf(x)); }
/// The hyperbolic tangent. Within 0.501 ULP.
inline float tanh(float x) {
  double a = clamp(static_cast<double>(x), -20.0, 20.0);
  return static_cast<float>(detail::sinhOf(a) / detail::coshOf(a));
}

/// The arc tangent, in [-pi/2, pi/2]. Within 0.501 ULP.
inline float atan(float x) {
  double angle = detail::atanOf(static_cast<double>(__builtin_fabsf(x)));
  return __builtin_copysignf(static_cast<float>(angle), x);
}
/// The angle of the point (x, y), in [-pi, pi]. Within 0.501 ULP.
inline float atan2(float y, float x) {
  if (x != x || y != y)
    return detail::quietNaN();
  float width = __builtin_fabsf(x), height = __builtin_fabsf(y);
  double angle;
  if (width == height)
    angle = height == 0.0f ? 0.0 : detail::halfPi * 0.5;
  else
    angle = detail::atanOf(static_cast<double>(height) /
                           static_cast<double>(width));
  angle = detail::isNegative(x) ? detail::pi - angle : angle;
  return __builtin_copysignf(static_cast<float>(angle), y);
}
/// The arc sine, in [-pi/2, pi/2]; NaN outside [-1, 1]. Within 0.501 ULP.
inline float asin(float x) {
  double a = __builtin_fabsf(x);
  double angle = detail::atanOf(a / __builtin_sqrt((1.0 - a) * (1.0 + a)));
  return __builtin_copysignf(static_cast<float>(angle), x);
}
/// The arc cosine, in [0, pi]; NaN outside [-1, 1]. Within 0.501 ULP.
inline float acos(float x) {
  double a = x;
  return static_cast<float>(
      2.0 * detail::atanOf(__builtin_sqrt((1.0 - a) / (1.0 + a))));
}

} // namespace piko

#include <piko/macros_end.h>

#endif // PIKO_MATH_H
