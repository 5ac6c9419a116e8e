//===- piko/math.h - Functions with the same bits everywhere --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The functions of piko:: on float, as plain C++ over + - * /, sqrt and fma,
// which IEEE 754 rounds correctly on every machine. So a pipeline computes the
// same bits in the reference executor and on every target. Inside, they compute
// in double, which keeps each within a stated number of units in the last place
// (ULP) of the exact result; the bound holds for all arguments and is verified
// by unittests/Language/MathBoundTest.cpp. Polynomials are Sollya's fpminimax,
// errors relative. Where a stage allows more ULP, some are those of
// piko/within.h.
//
// Special cases (infinities, NaN, signed zeros) follow IEEE 754 and C.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_MATH_H
#define PIKO_MATH_H

#ifdef __PIKO__
#include <piko/markers.h>
#endif

#include <piko/macros_begin.h>

#include <stdint.h>

#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif

namespace piko {
namespace detail {

inline uint64_t bitsOf(double x) { return __builtin_bit_cast(uint64_t, x); }
inline double fromBits(uint64_t b) { return __builtin_bit_cast(double, b); }
/// Whether the stage allows functions that are so far from the exact result.
inline bool allowsUlps([[maybe_unused]] int32_t ulps) {
#ifdef __PIKO__
  return marker::allowsUlps(ulps);
#else
  return false;
#endif
}
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

/// a * b + c, rounded once: an instruction of every processor since 2013, and
/// a function of the C library for those before.
inline double fma(double a, double b, double c) {
  return __builtin_fma(a, b, c);
}
/// first + x * (second + x * ...), each step rounded once.
inline double polynomial(double, double last) { return last; }
template <class... Rest>
inline double polynomial(double x, double first, Rest... rest) {
  return fma(polynomial(x, rest...), x, first);
}

/// 2^x by 2^k 2^r with |r| <= 1/2. The polynomial's error is 4.0e-11.
inline double exp2(double x) {
  constexpr double toInteger = 0x1.8p52; // adding it leaves an integer
  x = x < -1000.0 ? -1000.0 : x;
  x = x > 1000.0 ? 1000.0 : x;
  double shifted = x + toInteger;
  double r = x - (shifted - toInteger);
  double p = polynomial(r, 0x1.ffffffffabbcep-1, 0x1.62e42ff116291p-1,
                        0x1.ebfbe0a4be7ccp-3, 0x1.c6b08aaf2e14bp-5,
                        0x1.3b29dc40d898dp-7, 0x1.5d8a70891805ep-10,
                        0x1.446a1fd9a7925p-13, 0x1.fe17830106be7p-17);
  return p * fromBits((bitsOf(shifted) + 1023) << 52);
}

/// The natural logarithm of a normal x > 0 in two parts: an exponent e (as a
/// double) and the logarithm of a mantissa in [sqrt(1/2), sqrt(2)), by the
/// inverse hyperbolic tangent. The polynomial's error is 1.0e-13.
struct Logarithm {
  double exponent, mantissa;
};
inline Logarithm logOf(double x) {
  constexpr uint64_t least = 0x3fe6a09e667f3bcd; // sqrt(1/2)
  uint64_t bits = bitsOf(x) - least + (uint64_t(1023) << 52);
  // The exponent as the last bits of 2^52.
  double e =
      fromBits((bits >> 52) | (uint64_t(1075) << 52)) - (0x1p52 + 1023.0);
  double m = fromBits((bits & 0xfffffffffffff) + least);
  double s = (m - 1.0) / (m + 1.0);
  double z = s * s, twice = s + s;
  double p = polynomial(z, 0x1.55555555651d9p-2, 0x1.999998c9404e3p-3,
                        0x1.2493250b7e52dp-3, 0x1.c67a5ccbc79cep-4,
                        0x1.8c9461d68c4b5p-4);
  return {e, fma(twice * z, p, twice)};
}

/// x - k pi/2 for the nearest integer k, and the last bits of k.
struct Angle {
  double rest;
  uint32_t quadrant;
};
/// For |x| < 2^25. What is left of x after the first product is exact where it
/// is small, as that is a multiple of 2^-52.
inline Angle reduceSmall(double x) {
  constexpr double toInteger = 0x1.8p52;
  double shifted = fma(x, 0x1.45f306dc9c883p-1, toInteger);
  double k = shifted - toInteger;
  double rest = fma(-k, 0x1.1a62633145c07p-54, fma(-k, halfPi, x));
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
  if (size < 0x1p25f) [[likely]]
    return reduceSmall(x);
  if (size < infinity()) [[likely]]
    return reduceLarge(x);
  return {static_cast<double>(quietNaN()), 0};
}

/// For |r| <= pi/4. The polynomials' errors are 1.9e-11 and 3.1e-13.
inline double sinOf(double r) {
  double z = r * r;
  return r * polynomial(z, 1.0, -0x1.555555545e87dp-3, 0x1.11110df0122fbp-7,
                        -0x1.a013a88a3496p-13, 0x1.6dbe4ad0c24cep-19);
}
inline double cosOf(double r) {
  double z = r * r;
  return polynomial(z, 1.0, -0x1.fffffffffe6a2p-2, 0x1.5555555150925p-5,
                    -0x1.6c16bae70efc5p-10, 0x1.a012999314472p-16,
                    -0x1.24750783c64c5p-22);
}
/// The sine of an angle plus `quarters` quarter turns.
inline double sinOf(Angle angle, uint32_t quarters) {
  uint32_t quadrant = angle.quadrant + quarters;
  double value = quadrant & 1 ? cosOf(angle.rest) : sinOf(angle.rest);
  return quadrant & 2 ? -value : value;
}

/// The hyperbolic sine and cosine: by exponentials, and the sine by a
/// polynomial where those cancel, whose error is 2.7e-13.
inline double sinhOf(double x) {
  if (x > -1.0 && x < 1.0) {
    double z = x * x;
    return x * polynomial(z, 1.0, 0x1.555555555821cp-3, 0x1.1111110854535p-7,
                          0x1.a01a1314d4348p-13, 0x1.71d206f0630e4p-19,
                          0x1.b558342a95a41p-26);
  }
  double power = exp2(x * log2e);
  return 0.5 * (power - 1.0 / power);
}
inline double coshOf(double x) {
  double power = exp2(x * log2e);
  return 0.5 * (power + 1.0 / power);
}
/// The hyperbolic tangent, by a polynomial below 0.54, whose error is 3.3e-12.
inline double tanhOf(double x) {
  double z = x * x;
  if (z < 0.3) {
    return x * polynomial(z, 1.0, -0x1.5555555529c53p-2, 0x1.111110a001b4dp-3,
                          -0x1.ba1b41cf29791p-5, 0x1.663ff843b85fcp-6,
                          -0x1.2141d665e8b1ap-7, 0x1.becca4eb9e406p-9,
                          -0x1.fcb949ce62fbap-11);
  }
  double size = __builtin_fabs(x);
  return __builtin_copysign(1.0 - 2.0 / (exp2(size * (2.0 * log2e)) + 1.0), x);
}

/// The angle of the point (x, y) for x, y >= 0, of which one is not 0 and one
/// is finite: from what is within pi/8 of an axis, or of the diagonal. The
/// polynomial's error is 3.2e-12.
inline double angleOf(double y, double x) {
  constexpr double tangent = 0x1.a827999fcef32p-2; // of pi/8
  bool isSteep = y * tangent > x, isTurned = y > x * tangent;
  double above = isSteep ? -x : isTurned ? y - x : y;
  double below = isSteep ? y : isTurned ? y + x : x;
  double from = isSteep ? halfPi : isTurned ? 0.5 * halfPi : 0.0;
  double t = above / below;
  double z = t * t;
  double p = polynomial(z, -0x1.5555555507b2fp-2, 0x1.99999837d8c75p-3,
                        -0x1.2491c560061b2p-3, 0x1.c6f776c9ef91bp-4,
                        -0x1.71de3fad6b92bp-4, 0x1.247993d56ff04p-4,
                        -0x1.4c0b20c879b32p-5);
  return from + fma(t * z, p, t);
}

/// The arc sine of s in [0, 1/2], whose square is z. The polynomial's error is
/// 3.2e-12.
inline double asinOf(double s, double z) {
  return s * polynomial(z, 1.0, 0x1.55555554e0559p-3, 0x1.333334f9c02b1p-4,
                        0x1.6db5ba110b151p-5, 0x1.f20cff106678bp-6,
                        0x1.6a6f6a021a1fp-6, 0x1.3d63a70db354cp-6,
                        0x1.582d3397a761ep-8, 0x1.e3baf528191c7p-6);
}

/// The cube root of a > 0, normal, by Newton's iteration for a^(-1/3): to third
/// order once, then to second order.
inline double cbrtOf(double a) {
  constexpr double third = 1.0 / 3.0;
  uint64_t high = (bitsOf(a) >> 32) * 0x55555556 >> 32; // a third
  double y = fromBits((0x553ef000 - high) << 32);
  double e = fma(-(a * y), y * y, 1.0);
  y = fma(y * e, fma(e, 2.0 / 9.0, third), y);
  e = fma(-(a * y), y * y, 1.0);
  y = fma(y * third, e, y);
  e = fma(-(a * y), y * y, 1.0);
  y = fma(y * third, e, y);
  return a * y * y;
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

namespace detail {
/// What all logarithms give where they are not finite.
inline float logOutside(float x) {
  if (x == 0.0f)
    return -infinity();
  return x > 0.0f ? x : quietNaN();
}
} // namespace detail
} // namespace piko

#include <piko/within.h>

namespace piko {

/// The cheaper function, where the stage allows it.
#define PIKO_WITHIN(NAME)                                                      \
  if (detail::allowsUlps(4))                                                   \
    return within::NAME<4>(x);                                                 \
  if (detail::allowsUlps(1))                                                   \
    return within::NAME<1>(x);

/// 1 / sqrt(x). Within 0.501 ULP.
inline float rsqrt(float x) {
  float y = 1.0f / __builtin_sqrtf(x);
  if (detail::allowsUlps(2) || !(y > 0.0f && y < detail::infinity()))
    return y;
  // A step of Newton's: 1 - x y^2, of which the product is exact in two parts.
  float high = x * y, low = fma(x, y, -high);
  float rest = fma(-low, y, fma(-high, y, 1.0f));
  return fma(0.5f * y, rest, y);
}

/// The square root of x * x + y * y; infinite if x or y is. Within 0.501 ULP.
inline float hypot(float x, float y) {
  float width = __builtin_fabsf(x), height = __builtin_fabsf(y);
  if (width == detail::infinity() || height == detail::infinity())
    return detail::infinity();
  double a = x, b = y;
  return static_cast<float>(__builtin_sqrt(detail::fma(a, a, b * b)));
}

/// The cube root. Within 0.501 ULP.
inline float cbrt(float x) {
  float size = __builtin_fabsf(x);
  if (!(size > 0.0f && size < detail::infinity()))
    return x;
  return __builtin_copysignf(static_cast<float>(detail::cbrtOf(size)), x);
}

/// 2 to the power x. Within 0.501 ULP.
inline float exp2(float x) {
  PIKO_WITHIN(exp2)
  return static_cast<float>(detail::exp2(x));
}
/// e to the power x. Within 0.501 ULP.
inline float exp(float x) {
  PIKO_WITHIN(exp)
  return static_cast<float>(detail::exp2(x * detail::log2e));
}

/// The natural logarithm. Within 0.501 ULP.
inline float log(float x) {
  PIKO_WITHIN(log)
  if (!(x > 0.0f && x < detail::infinity()))
    return detail::logOutside(x);
  detail::Logarithm l = detail::logOf(x);
  return static_cast<float>(detail::fma(l.exponent, detail::ln2, l.mantissa));
}
/// The logarithm to base 2. Within 0.501 ULP.
inline float log2(float x) {
  if (detail::allowsUlps(4))
    return within::log2<4>(x);
  if (!(x > 0.0f && x < detail::infinity()))
    return detail::logOutside(x);
  detail::Logarithm l = detail::logOf(x);
  return static_cast<float>(detail::fma(l.mantissa, detail::log2e, l.exponent));
}

/// The logarithm to base 10. Within 0.501 ULP.
inline float log10(float x) {
  PIKO_WITHIN(log10)
  if (!(x > 0.0f && x < detail::infinity()))
    return detail::logOutside(x);
  detail::Logarithm l = detail::logOf(x);
  return static_cast<float>(
      detail::fma(l.exponent, detail::log10of2, l.mantissa * detail::log10e));
}

namespace detail {
/// With `isNear`, within 1 ULP.
inline float pow(float x, float y, bool isNear) {
  if (y == 0.0f || x == 1.0f)
    return 1.0f;
  if (x != x || y != y)
    return quietNaN();
  float size = __builtin_fabsf(x);
  bool integral = __builtin_floorf(y) == y;
  if (x < 0.0f && size < infinity() && !integral)
    return quietNaN();
  double log2OfSize;
  if (size > 0.0f && size < infinity()) {
    Logarithm l = logOf(size);
    log2OfSize = fma(l.mantissa, log2e, l.exponent);
  } else {
    log2OfSize = logOutside(size);
  }
  double power = size == 1.0f ? 0.0 : y * log2OfSize;
  float result =
      isNear ? within::exp2Of(power) : static_cast<float>(exp2(power));
  bool odd = integral && __builtin_fabsf(y) < 0x1p24f &&
             (static_cast<int32_t>(y) & 1) != 0;
  return odd && isNegative(x) ? -result : result;
}
} // namespace detail

/// x to the power y. Within 0.501 ULP.
inline float pow(float x, float y) {
  return detail::pow(x, y, detail::allowsUlps(1));
}

/// The sine of an angle in radians. Within 0.501 ULP.
inline float sin(float x) {
  PIKO_WITHIN(sin)
  return static_cast<float>(detail::sinOf(detail::reduce(x), 0));
}
/// The cosine of an angle in radians. Within 0.501 ULP.
inline float cos(float x) {
  PIKO_WITHIN(cos)
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
inline float tanh(float x) { return static_cast<float>(detail::tanhOf(x)); }

/// The arc tangent, in [-pi/2, pi/2]. Within 0.501 ULP.
inline float atan(float x) {
  double angle = detail::angleOf(__builtin_fabsf(x), 1.0);
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
    angle = detail::angleOf(height, width);
  angle = detail::isNegative(x) ? detail::pi - angle : angle;
  return __builtin_copysignf(static_cast<float>(angle), y);
}
/// The arc sine, in [-pi/2, pi/2]; NaN outside [-1, 1]. Within 0.501 ULP.
inline float asin(float x) {
  double a = __builtin_fabsf(x);
  bool isLarge = a > 0.5;
  double z = isLarge ? 0.5 - 0.5 * a : a * a;
  double angle = detail::asinOf(isLarge ? __builtin_sqrt(z) : a, z);
  angle = isLarge ? detail::halfPi - 2.0 * angle : angle;
  return __builtin_copysignf(static_cast<float>(angle), x);
}
/// The arc cosine, in [0, pi]; NaN outside [-1, 1]. Within 0.501 ULP.
inline float acos(float x) {
  double a = __builtin_fabsf(x);
  bool isLarge = a > 0.5;
  double z = isLarge ? 0.5 - 0.5 * a : a * a;
  double angle = detail::asinOf(isLarge ? __builtin_sqrt(z) : a, z);
  // From 0, from pi/2 on, or up to pi.
  if (!isLarge)
    angle = x < 0.0f ? detail::halfPi + angle : detail::halfPi - angle;
  else
    angle = x < 0.0f ? detail::pi - 2.0 * angle : 2.0 * angle;
  return static_cast<float>(angle);
}

#undef PIKO_WITHIN

} // namespace piko

#include <piko/macros_end.h>

#endif // PIKO_MATH_H
