//===- MathTest.cpp - The stated bounds of piko/math.h --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Every function is compared with long double libm on a fine grid of floats:
// every `stride`-th bit pattern, so all exponents, denormals, infinities and
// NaNs are among them.
//
//===----------------------------------------------------------------------===//
#include <piko/bins.h>
#include <piko/math.h>

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace {

constexpr double bound = 0.501;
constexpr uint32_t stride = 2503; // 1.7 million floats

/// The distance of a float from the exact value, in units in the last place
/// of a float of the exact value's size; 0 where both are NaN or the same
/// infinity.
double ulpError(float got, long double exact) {
  float rounded = static_cast<float>(exact);
  if (std::isnan(exact) || std::isinf(rounded) || std::isnan(got))
    return std::isnan(exact) && std::isnan(got) ? 0
           : got == rounded                     ? 0
                                                : INFINITY;
  if (exact == 0)
    return got == 0 && std::signbit(got) == std::signbit(exact) ? 0 : INFINITY;
  int exponent = std::max(std::ilogb(exact), -126) - 23;
  return static_cast<double>(std::fabs(got - exact) *
                             std::ldexp(1.0L, -exponent));
}

template <class F, class Exact> void checkAll(F f, Exact exact) {
  double worst = 0;
  float where = 0;
  uint32_t bits = 0;
  do {
    float x = std::bit_cast<float>(bits);
    double error = ulpError(f(x), exact(static_cast<long double>(x)));
    if (error > worst)
      worst = error, where = x;
    bits += stride;
  } while (bits >= stride);
  for (float x : {0.0f, -0.0f, 1.0f, -1.0f, INFINITY, -INFINITY, 0x1p-149f,
                  -0x1p-149f, 0x1p-126f, 3.4028235e38f, -3.4028235e38f}) {
    double error = ulpError(f(x), exact(static_cast<long double>(x)));
    if (error > worst)
      worst = error, where = x;
  }
  EXPECT_LE(worst, bound) << "at " << std::hexfloat << where;
}

#define PIKO_CHECK(NAME)                                                       \
  TEST(Math, NAME) {                                                           \
    checkAll([](float x) { return piko::NAME(x); },                            \
             [](long double x) { return std::NAME(x); });                      \
  }
PIKO_CHECK(exp)
PIKO_CHECK(exp2)
PIKO_CHECK(log)
PIKO_CHECK(log2)
PIKO_CHECK(sin)
PIKO_CHECK(cos)
PIKO_CHECK(tan)
PIKO_CHECK(atan)
PIKO_CHECK(asin)
PIKO_CHECK(acos)
PIKO_CHECK(cbrt)
#undef PIKO_CHECK

TEST(Math, rsqrt) {
  checkAll([](float x) { return piko::rsqrt(x); },
           [](long double x) { return 1 / std::sqrt(x); });
}

TEST(Math, SinOfLargeAngles) {
  // Near multiples of pi/2 the reduction has the most to cancel.
  double worst = 0;
  for (long k = 1; k < 2000000; k += 7) {
    float x = static_cast<float>(k * 1.57079632679489661923L);
    for (float y : {x, std::nextafter(x, 0.0f), x * 0x1p20f, x * 0x1p90f}) {
      long double exact = y;
      worst = std::max(worst, ulpError(piko::sin(y), std::sin(exact)));
      worst = std::max(worst, ulpError(piko::cos(y), std::cos(exact)));
    }
  }
  EXPECT_LE(worst, bound);
}

TEST(Math, pow) {
  double worst = 0;
  std::mt19937 random(1);
  for (int i = 0; i < 1000000; ++i) {
    float x = std::bit_cast<float>(static_cast<uint32_t>(random()));
    float y = std::bit_cast<float>(static_cast<uint32_t>(random()));
    if (i % 2) { // where the result is finite
      x = std::fabs(x);
      y = std::uniform_real_distribution<float>(-128, 128)(random) /
          std::log2(x);
    }
    if (i % 4 == 3) // near one
      x = 1 + std::uniform_real_distribution<float>(-0.01f, 0.01f)(random),
      y = std::uniform_real_distribution<float>(-5000, 5000)(random);
    long double exact =
        std::pow(static_cast<long double>(x), static_cast<long double>(y));
    double error = ulpError(piko::pow(x, y), exact);
    EXPECT_LE(error, bound) << x << " " << y;
    worst = std::max(worst, error);
  }
  float special[] = {0.0f, -0.0f, 1,     -1,       2,         -2,  3,    -3,
                     0.5f, -0.5f, 1e30f, INFINITY, -INFINITY, NAN, 3e7f, -7};
  for (float x : special)
    for (float y : special)
      EXPECT_LE(ulpError(piko::pow(x, y), std::pow((long double)x, y)), bound)
          << x << " " << y;
}

TEST(Math, atan2) {
  std::mt19937 random(2);
  auto check = [](float y, float x) {
    EXPECT_LE(ulpError(piko::atan2(y, x), std::atan2((long double)y, x)), bound)
        << y << " " << x;
  };
  for (int i = 0; i < 500000; ++i)
    check(std::bit_cast<float>(static_cast<uint32_t>(random())),
          std::bit_cast<float>(static_cast<uint32_t>(random())));
  std::uniform_real_distribution<float> unit(-1, 1);
  for (int i = 0; i < 500000; ++i)
    check(unit(random), unit(random));
  for (float x : {0.0f, -0.0f, 1.0f, -1.0f, INFINITY, -INFINITY})
    for (float y : {0.0f, -0.0f, 1.0f, -1.0f, INFINITY, -INFINITY})
      check(y, x);
}

TEST(Math, fmaIsRoundedOnce) {
  std::mt19937 random(3);
  auto check = [](float a, float b, float c) {
    float got = piko::fma(a, b, c), exact = std::fma(a, b, c);
    EXPECT_TRUE(std::isnan(exact) ? std::isnan(got)
                                  : std::bit_cast<uint32_t>(got) ==
                                        std::bit_cast<uint32_t>(exact))
        << std::hexfloat << a << " " << b << " " << c;
  };
  for (int i = 0; i < 1000000; ++i) {
    float a = std::bit_cast<float>(static_cast<uint32_t>(random()));
    float b = std::bit_cast<float>(static_cast<uint32_t>(random()));
    float c = std::bit_cast<float>(static_cast<uint32_t>(random()));
    check(a, b, c);
    // Sums that almost cancel, or that end halfway between two floats.
    float product = a * b;
    check(a, b, -product);
    check(a, b, product * 0x1p-24f);
    check(a, b, product * 0x1p24f);
    check(a, b, product * 0x1p-60f);
  }
  // A tie that double rounding would get wrong.
  check(0x1.000002p0f, 0x1.000002p0f, 0x1p-60f);
  check(1.0f + 0x1p-12f, 1.0f + 0x1p-12f, 0x1p-80f);
  check(1.0f + 0x1p-12f, 1.0f + 0x1p-12f, -0x1p-80f);
}

TEST(Math, roundings) {
  for (uint32_t bits = 0; bits < 0xff000000u; bits += stride) {
    float x = std::bit_cast<float>(bits);
    if (std::isnan(x))
      continue;
    EXPECT_EQ(piko::floor(x), std::floor(x));
    EXPECT_EQ(piko::ceil(x), std::ceil(x));
    EXPECT_EQ(piko::trunc(x), std::trunc(x));
    EXPECT_EQ(piko::round(x), std::nearbyint(x));
    EXPECT_EQ(std::signbit(piko::round(x)), std::signbit(x));
  }
}

TEST(Math, conversionsSaturate) {
  EXPECT_EQ(piko::toInt(2.9f), 2);
  EXPECT_EQ(piko::toInt(-2.9f), -2);
  EXPECT_EQ(piko::toInt(3e9f), INT32_MAX);
  EXPECT_EQ(piko::toInt(-3e9f), INT32_MIN);
  EXPECT_EQ(piko::toInt(-2147483648.0f), INT32_MIN);
  EXPECT_EQ(piko::toInt(2147483520.0f), 2147483520);
  EXPECT_EQ(piko::toInt(NAN), 0);
  EXPECT_EQ(piko::toInt(INFINITY), INT32_MAX);
  EXPECT_EQ(piko::toInt(-INFINITY), INT32_MIN);
  EXPECT_EQ(piko::toUint(-1.0f), 0u);
  EXPECT_EQ(piko::toUint(4e9f), 4000000000u);
  EXPECT_EQ(piko::toUint(5e9f), UINT32_MAX);
  EXPECT_EQ(piko::toUint(NAN), 0u);
  EXPECT_EQ(piko::toInt64(1e19f), INT64_MAX);
  EXPECT_EQ(piko::toInt64(-1e19f), INT64_MIN);
  EXPECT_EQ(piko::toInt64(NAN), 0);
}

TEST(Math, minAndMaxKeepTheFirstOfEqualsAndOfNaN) {
  EXPECT_TRUE(std::isnan(piko::min(NAN, 1.0f)));
  EXPECT_EQ(piko::min(1.0f, NAN), 1.0f);
  EXPECT_TRUE(std::isnan(piko::max(NAN, 1.0f)));
  EXPECT_EQ(piko::max(1.0f, NAN), 1.0f);
  EXPECT_TRUE(std::signbit(piko::min(-0.0f, 0.0f)));
  EXPECT_FALSE(std::signbit(piko::min(0.0f, -0.0f)));
  EXPECT_EQ(piko::clamp(5, 0, 3), 3);
  EXPECT_EQ(piko::abs(INT32_MIN), INT32_MIN);
}

} // namespace
