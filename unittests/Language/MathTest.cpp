//===- MathTest.cpp - The exact functions of piko/math.h ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Results that have one right value. Those within a bound are in
// MathBoundTest.cpp.
//
//===----------------------------------------------------------------------===//
#include <piko/math.h>

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

namespace {

constexpr uint32_t stride = 2503; // 1.7 million floats

// Annex F of C: 9.4.4 for pow, 9.1.4 for atan2, 9.4.3 for hypot.
constexpr float inf = INFINITY;

TEST(Math, specialPowers) {
  auto expect = [](float x, float y, float power) {
    float got = piko::pow(x, y);
    EXPECT_TRUE(std::isnan(power) ? std::isnan(got)
                                  : std::bit_cast<uint32_t>(got) ==
                                        std::bit_cast<uint32_t>(power))
        << x << " to the power " << y << " is " << got;
  };
  const float any[] = {0.0f, -0.0f, 0.5f, -0.5f,   1,   -1,   2,
                       -2,   3,     -3,   0x1p30f, inf, -inf, NAN};
  for (float y : any)
    expect(1, y, 1);
  for (float x : any)
    for (float zero : {0.0f, -0.0f})
      expect(x, zero, 1);
  for (float x : any)
    if (x != 1)
      expect(x, NAN, NAN);
  for (float y : any)
    if (y != 0)
      expect(NAN, y, NAN);

  // 16777215 is the largest odd float.
  for (float odd : {1.0f, 3.0f, 16777215.0f}) {
    expect(0.0f, -odd, inf);
    expect(-0.0f, -odd, -inf);
    expect(0.0f, odd, 0.0f);
    expect(-0.0f, odd, -0.0f);
    expect(-inf, -odd, -0.0f);
    expect(-inf, odd, -inf);
    expect(inf, -odd, 0.0f);
    expect(inf, odd, inf);
    expect(-1, odd, -1);
    expect(-1, -odd, -1);
  }
  for (float other : {0.5f, 2.0f, 2.5f, 0x1p24f, 0x1p30f, 3.4e38f, inf}) {
    expect(0.0f, -other, inf);
    expect(-0.0f, -other, inf);
    expect(0.0f, other, 0.0f);
    expect(-0.0f, other, 0.0f);
    expect(-inf, -other, 0.0f);
    expect(-inf, other, inf);
    expect(inf, -other, 0.0f);
    expect(inf, other, inf);
  }
  for (float even : {2.0f, 0x1p24f, inf}) {
    expect(-1, even, 1);
    expect(-1, -even, 1);
  }
  for (float x : {-2.0f, -0.5f, -1.0f, -0x1p-149f, -3.4e38f})
    for (float fraction : {0.5f, -0.5f, 2.5f, -8388607.5f})
      expect(x, fraction, NAN);
  for (float x : {2.0f, -2.0f, 1.0000001f, -3.4e38f}) {
    expect(x, inf, inf);
    expect(x, -inf, 0.0f);
  }
  for (float x : {0.5f, -0.5f, 0.99999994f, -0x1p-149f}) {
    expect(x, inf, 0.0f);
    expect(x, -inf, inf);
  }

  expect(2, -149, 0x1p-149f);
  expect(2, -150, 0.0f); // halfway to the least denormal
  expect(2, 127, 0x1p127f);
  expect(-2, 127, -0x1p127f);
  expect(2, 128, inf);
  expect(-2, 129, -inf);
  expect(-2, -151, -0.0f);
  expect(-3, 3, -27);
  expect(16777215, 1, 16777215);
}

TEST(Math, specialAngles) {
  auto expect = [](float y, float x, float angle) {
    for (float sign : {1.0f, -1.0f})
      EXPECT_EQ(std::bit_cast<uint32_t>(piko::atan2(sign * y, x)),
                std::bit_cast<uint32_t>(sign * angle))
          << sign * y << " " << x;
  };
  const float pi = 0x1.921fb6p+1f;
  for (float x : {0.0f, 1.0f, 0x1p-149f, inf})
    expect(0, x, 0);
  for (float x : {-0.0f, -1.0f, -0x1p-149f, -inf})
    expect(0, x, pi);
  for (float y : {1.0f, 0x1p-149f, inf}) {
    expect(y, 0.0f, pi / 2);
    expect(y, -0.0f, pi / 2);
  }
  for (float y : {1.0f, 0x1p-149f, 3.4e38f}) {
    expect(y, inf, 0);
    expect(y, -inf, pi);
    expect(inf, y, pi / 2);
    expect(inf, -y, pi / 2);
  }
  expect(inf, inf, pi / 4);
  expect(inf, -inf, 0x1.2d97c8p+1f);
  EXPECT_TRUE(std::isnan(piko::atan2(NAN, 1.0f)));
  EXPECT_TRUE(std::isnan(piko::atan2(1.0f, NAN)));
}

TEST(Math, specialHypotenuses) {
  for (float x : {inf, -inf})
    for (float y : {0.0f, -1.0f, inf, NAN}) {
      EXPECT_EQ(piko::hypot(x, y), inf);
      EXPECT_EQ(piko::hypot(y, x), inf);
    }
  EXPECT_TRUE(std::isnan(piko::hypot(NAN, 1.0f)));
  EXPECT_TRUE(std::isnan(piko::hypot(0.0f, NAN)));
  EXPECT_EQ(piko::hypot(-0x1p-149f, 0.0f), 0x1p-149f);
  EXPECT_EQ(piko::hypot(3e38f, -3e38f), inf);
  EXPECT_EQ(piko::hypot(-3.0f, 4.0f), 5.0f);
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
