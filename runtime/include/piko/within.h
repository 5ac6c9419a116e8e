//===- piko/within.h - Functions in floats, within a few units ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A part of piko/math.h, which includes it after what it needs. What that
// computes in double, in float: twice as many lanes, and less work. Each is
// within 1 or 4 units in the last place (ULP), its template argument, of the
// exact result; the bound holds for all arguments, and
// unittests/Language/MathBoundTest.cpp verifies it. Only stages that allow so
// much have them (specifyUlps). The same bits everywhere, as all products that
// are added are piko::fma.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_WITHIN_H
#define PIKO_WITHIN_H

namespace piko::within {

inline uint32_t bitsOf(float x) { return __builtin_bit_cast(uint32_t, x); }
inline float fromBits(uint32_t b) { return __builtin_bit_cast(float, b); }

inline float polynomial(float, float last) { return last; }
template <class... Rest>
inline float polynomial(float x, float first, Rest... rest) {
  return fma(polynomial(x, rest...), x, first);
}

constexpr float toInteger = 0x1.8p23f;        ///< Adding it leaves an integer,
constexpr uint32_t integerBits = 0x4b400000u; ///< in the bits after these.

inline float powerOfTwo(int32_t n) {
  return fromBits(static_cast<uint32_t>(n + 127) << 23);
}
/// x 2^n for n from -252 to 254, rounded once.
inline float scale(float x, int32_t n) {
  int32_t half = n >> 1;
  return x * powerOfTwo(half) * powerOfTwo(n - half);
}

/// 2^r for |r| <= 1/2.
inline float powerOf(float r) {
  float p = polynomial(r, 0x1.62e43p-1f, 0x1.ebfbep-3f, 0x1.c6af9cp-5f,
                       0x1.3b2a48p-7f, 0x1.5ef5dp-10f, 0x1.442512p-13f);
  return fma(r, p, 1.0f);
}

template <int Ulps> inline float exp2(float x) {
  x = x < -152.0f ? -152.0f : x;
  x = x > 130.0f ? 130.0f : x;
  float shifted = x + toInteger;
  float r = x - (shifted - toInteger);
  return scale(powerOf(r), static_cast<int32_t>(bitsOf(shifted) - integerBits));
}

template <int Ulps> inline float exp(float x) {
  x = x < -105.0f ? -105.0f : x;
  x = x > 90.0f ? 90.0f : x;
  float shifted = fma(x, 0x1.715476p+0f, toInteger);
  float k = shifted - toInteger;
  float r = fma(-k, -0x1.05c61p-29f, fma(-k, 0x1.62e43p-1f, x));
  float q = Ulps < 4
                ? polynomial(r, 0x1p-1f, 0x1.555556p-3f, 0x1.555502p-5f,
                             0x1.110fc2p-7f, 0x1.6d2e06p-10f, 0x1.a2d99ap-13f)
                : polynomial(r, 0x1p-1f, 0x1.5554dcp-3f, 0x1.5554eap-5f,
                             0x1.120c08p-7f, 0x1.6d4bfep-10f);
  float power = 1.0f + fma(r * r, q, r);
  return scale(power, static_cast<int32_t>(bitsOf(shifted) - integerBits));
}

/// The logarithm of x > 0 in three parts: an exponent e, f, which is a mantissa
/// in [sqrt(1/2), sqrt(2)) less 1, and the rest of the mantissa's logarithm.
struct Logarithm {
  float exponent, f, rest;
};
template <int Ulps> inline Logarithm logOf(float x) {
  constexpr uint32_t least = 0x3f3504f3u, one = 0x3f800000u; // sqrt(1/2)
  bool isDenormal = x < 0x1p-126f;
  x = isDenormal ? x * 0x1p23f : x;
  uint32_t bits = bitsOf(x) - least + one;
  float e = static_cast<float>(static_cast<int32_t>(bits >> 23) -
                               (isDenormal ? 150 : 127));
  float f = fromBits((bits & 0x7fffffu) + least) - 1.0f;
  float p = Ulps < 4
                ? polynomial(f, 0x1.555554p-2f, -0x1.ffffe6p-3f, 0x1.999d2ap-3f,
                             -0x1.556288p-3f, 0x1.23de3ep-3f, -0x1.fbbf2ap-4f,
                             0x1.dc7628p-4f, -0x1.ddb316p-4f, 0x1.2cb38cp-4f)
                : polynomial(f, 0x1.555584p-2f, -0x1.0002f6p-2f, 0x1.995186p-3f,
                             -0x1.53a0e8p-3f, 0x1.2bf2b4p-3f, -0x1.22dbbep-3f,
                             0x1.85364ep-4f);
  float square = f * f;
  return {e, f, fma(f * square, p, -0.5f * square)};
}
inline bool isFinite(float x) { return x > 0.0f && x < detail::infinity(); }

template <int Ulps> inline float log(float x) {
  if (!isFinite(x))
    return detail::logOutside(x);
  Logarithm l = logOf<Ulps>(x);
  float rest = fma(l.exponent, -0x1.05c61p-29f, l.rest);
  return fma(l.exponent, 0x1.62e43p-1f, l.f + rest);
}
/// Within 4 ULP: in floats, the product with log2(e) leaves no room for 1.
template <int Ulps>
  requires(Ulps >= 4)
inline float log2(float x) {
  if (!isFinite(x))
    return detail::logOutside(x);
  Logarithm l = logOf<Ulps>(x);
  float rest = fma(l.rest, 0x1.715476p+0f, l.f * 0x1.4ae0cp-26f);
  return l.exponent + fma(l.f, 0x1.715476p+0f, rest);
}
template <int Ulps> inline float log10(float x) {
  if (!isFinite(x))
    return detail::logOutside(x);
  Logarithm l = logOf<Ulps>(x);
  float rest = fma(l.f, -0x1.5b235ep-27f, l.exponent * -0x1.ec10cp-27f);
  rest = fma(l.rest, 0x1.bcb7b2p-2f, rest);
  return fma(l.exponent, 0x1.344136p-2f, fma(l.f, 0x1.bcb7b2p-2f, rest));
}

/// x - k pi/2 for the nearest integer k, in two parts, and the last bits of k.
struct Angle {
  float high, low;
  uint32_t quadrant;
};
template <int Ulps> inline Angle reduce(float x) {
  if (__builtin_fabsf(x) < 0x1p20f) [[likely]] {
    float shifted = fma(x, 0x1.45f306p-1f, toInteger);
    float k = shifted - toInteger;
    // Exact, as it is a multiple of 2^-22, or 2^-24 below 1. The parts of
    // pi/2 are positive, which keeps -0.
    float first = fma(-k, 0x1.921fb4p+0f, x);
    constexpr float second = 0x1.4442dp-24f, third = 0x1.846988p-48f;
    if constexpr (Ulps >= 4)
      return {fma(-k, third, fma(-k, second, first)), 0.0f, bitsOf(shifted)};
    // The product, the sum, and what either leaves out. The product is an fma
    // so that nobody contracts it with the sum.
    float product = fma(-k, second, 0.0f), left = fma(-k, second, -product);
    float high = first + product, part = high - first;
    float error = (first - (high - part)) + (product - part);
    return {high, error + fma(-k, third, left), bitsOf(shifted)};
  }
  detail::Angle angle = detail::reduce(x);
  float high = static_cast<float>(angle.rest);
  return {high, static_cast<float>(angle.rest - static_cast<double>(high)),
          angle.quadrant};
}

template <int Ulps> inline float sinOf(Angle a) {
  float z = a.high * a.high;
  float p = Ulps < 4 ? polynomial(z, -0x1.555556p-3f, 0x1.111194p-7f,
                                  -0x1.a07c46p-13f, 0x1.850f12p-19f)
                     : polynomial(z, -0x1.555552p-3f, 0x1.110ba8p-7f,
                                  -0x1.9a8caep-13f);
  if constexpr (Ulps >= 4)
    return a.high * fma(z, p, 1.0f);
  return a.high + fma(a.high * z, p, a.low);
}
template <int Ulps> inline float cosOf(Angle a) {
  float z = a.high * a.high;
  float p = polynomial(z, 0x1.555554p-5f, -0x1.6c126cp-10f, 0x1.9ba7bap-16f);
  if constexpr (Ulps >= 4)
    return fma(z * z, p, fma(-0.5f, z, 1.0f));
  float half = 0.5f * z, most = 1.0f - half;
  float rest = fma(-a.high, a.low, (1.0f - most) - half);
  return most + fma(z * z, p, rest);
}
/// The sine of an angle plus `quarters` quarter turns.
template <int Ulps> inline float sinOf(Angle angle, uint32_t quarters) {
  uint32_t quadrant = angle.quadrant + quarters;
  float value = quadrant & 1 ? cosOf<Ulps>(angle) : sinOf<Ulps>(angle);
  return quadrant & 2 ? -value : value;
}
template <int Ulps> inline float sin(float x) {
  float value = sinOf<Ulps>(reduce<Ulps>(x), 0);
  return Ulps < 4 && x == 0.0f ? x : value; // also -0
}
template <int Ulps> inline float cos(float x) {
  return sinOf<Ulps>(reduce<Ulps>(x), 1);
}

/// 2^t.
inline float exp2Of(double t) {
  constexpr double toWhole = 0x1.8p52;
  t = t < -152.0 ? -152.0 : t;
  t = t > 130.0 ? 130.0 : t;
  double shifted = t + toWhole;
  float r = static_cast<float>(t - (shifted - toWhole));
  return scale(powerOf(r), static_cast<int32_t>(
                               static_cast<uint32_t>(detail::bitsOf(shifted))));
}

} // namespace piko::within

#endif // PIKO_WITHIN_H
