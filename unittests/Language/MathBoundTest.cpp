//===- MathBoundTest.cpp - The stated bounds of piko/math.h ---------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Two references. MPFR gives the exact value, on random and on hard arguments.
// The C library's functions of double, which are within a few ULP of a double,
// that is 1e-8 ULP of a float, are fast enough for all floats:
//
//   PIKO_MATH_STRIDE=1 build/bin/PikoMathTests
//     --gtest_filter='MathBound.*OfAllFloats'
//
// takes a minute or two for each function; by default, every 2503rd float.
//
//===----------------------------------------------------------------------===//
#include <piko/math.h>

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <mpfr.h>
#include <random>

namespace {

constexpr double bound = 0.501;

/// The distance of a float from the exact value, in units in the last place
/// of a float of the exact value's size; 0 where both are NaN or the same
/// infinity.
template <class Exact> double ulpError(float got, Exact exact) {
  float rounded = static_cast<float>(exact);
  if (std::isnan(exact) || std::isinf(rounded) || std::isnan(got))
    return std::isnan(exact) && std::isnan(got) ? 0
           : got == rounded                     ? 0
                                                : INFINITY;
  if (exact == 0)
    return got == 0 && std::signbit(got) == std::signbit(exact) ? 0 : INFINITY;
  // The unit is 2^-23 of the power of two below the value.
  uint64_t bits = std::bit_cast<uint64_t>(static_cast<double>(exact));
  int64_t exponent = std::max<int64_t>((bits >> 52) & 2047, 1023 - 126) - 23;
  double unit = std::bit_cast<double>(static_cast<uint64_t>(exponent) << 52);
  return static_cast<double>(std::fabs(static_cast<Exact>(got) - exact)) / unit;
}

/// The greatest error of a function and where it is.
struct Worst {
  double error = 0;
  float at[2] = {};

  void add(double e, float x, float y = 0) {
    if (e > error)
      error = e, at[0] = x, at[1] = y;
  }
  void expectWithin(double most) const {
    std::printf("at most %.6f ULP, at %a %a\n", error, double(at[0]),
                double(at[1]));
    EXPECT_LE(error, most) << "at " << std::hexfloat << at[0] << " " << at[1];
  }
};

//===----------------------------------------------------------------------===//
// The C library
//===----------------------------------------------------------------------===//

template <class F, class Exact>
void checkAllFloats(F f, Exact exact, double most = bound) {
  const char *text = std::getenv("PIKO_MATH_STRIDE");
  uint64_t stride = text ? std::strtoul(text, nullptr, 10) : 2503;
  Worst worst;
  for (uint64_t bits = 0; bits >> 32 == 0; bits += stride) {
    float x = std::bit_cast<float>(static_cast<uint32_t>(bits));
    worst.add(ulpError(f(x), exact(static_cast<double>(x))), x);
  }
  worst.expectWithin(most);
}

//===----------------------------------------------------------------------===//
// MPFR
//===----------------------------------------------------------------------===//

using Mpfr1 = int (*)(mpfr_ptr, mpfr_srcptr, mpfr_rnd_t);
using Mpfr2 = int (*)(mpfr_ptr, mpfr_srcptr, mpfr_srcptr, mpfr_rnd_t);

class Number {
public:
  Number() { mpfr_init2(value, 96); }
  ~Number() { mpfr_clear(value); }
  Number(const Number &) = delete;
  operator mpfr_ptr() { return value; }

private:
  mpfr_t value;
};

long double evaluate(Mpfr1 f, float x) {
  static Number a, result;
  mpfr_set_flt(a, x, MPFR_RNDN);
  f(result, a, MPFR_RNDN);
  return mpfr_get_ld(result, MPFR_RNDN);
}
long double evaluate(Mpfr2 f, float x, float y) {
  static Number a, b, result;
  mpfr_set_flt(a, x, MPFR_RNDN);
  mpfr_set_flt(b, y, MPFR_RNDN);
  f(result, a, b, MPFR_RNDN);
  return mpfr_get_ld(result, MPFR_RNDN);
}

std::vector<float> makeSpecialArguments() {
  std::vector<float> result;
  for (float x : {0.0f, 0x1p-149f, 0x1.fffffcp-127f, 0x1p-126f, 0x1p-12f, 0.5f,
                  0.70710678f, 1.0f, 1.41421356f, 2.0f, 3.0f, 10.0f, 27.0f,
                  0x1p23f, 0x1p24f, 0x1p25f, 0x1p31f, 0x1.fffffep127f,
                  std::numeric_limits<float>::infinity()})
    for (float y : {std::nextafter(x, 0.0f), x, std::nextafter(x, INFINITY)}) {
      result.push_back(y);
      result.push_back(-y);
    }
  result.push_back(NAN);
  return result;
}

/// Special, random, and hard: near 1, at the edges of overflow and underflow of
/// exponentials, and next to multiples of pi/2 up to the largest floats.
std::vector<float> makeArguments() {
  std::vector<float> result = makeSpecialArguments();
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (int i = 0; i < 8000; ++i) {
    result.push_back(std::bit_cast<float>(static_cast<uint32_t>(random())));
    result.push_back(unit(random));
    result.push_back(8 * unit(random));
    float close = unit(random);
    result.push_back(1 + close * close * close * close * close);
    result.push_back(
        std::bit_cast<float>(static_cast<uint32_t>(random() & 0x807fffffu)));
  }
  const float edges[] = {88.722839f, -87.336545f, -103.97208f, 128,
                         -126,       -149,        -150,        89.415988f};
  for (float edge : edges)
    for (int i = -50; i <= 50; ++i)
      result.push_back(std::bit_cast<float>(std::bit_cast<uint32_t>(edge) +
                                            static_cast<uint32_t>(i)));
  Number pi, multiple;
  mpfr_set_prec(pi, 400);
  mpfr_set_prec(multiple, 400);
  mpfr_const_pi(pi, MPFR_RNDN);
  for (int exponent = -1; exponent < 127; ++exponent)
    for (int i = 0; i < 40; ++i) {
      // The multiple of pi/2 that is closest to a random number of this size.
      mpfr_set_flt(multiple, std::ldexp(1.5f + 0.5f * unit(random), exponent),
                   MPFR_RNDN);
      mpfr_div(multiple, multiple, pi, MPFR_RNDN);
      mpfr_mul_2ui(multiple, multiple, 1, MPFR_RNDN);
      mpfr_rint(multiple, multiple, MPFR_RNDN);
      mpfr_mul(multiple, multiple, pi, MPFR_RNDN);
      mpfr_div_2ui(multiple, multiple, 1, MPFR_RNDN);
      float x = mpfr_get_flt(multiple, MPFR_RNDN);
      result.insert(result.end(), {x, -std::nextafter(x, 0.0f)});
    }
  // Of all floats, this is closest to a multiple of pi/2.
  result.push_back(16367173 * 0x1p72f);
  return result;
}

template <class F> void checkHard(F f, Mpfr1 exact, double most = bound) {
  static const std::vector<float> arguments = makeArguments();
  Worst worst;
  for (float x : arguments)
    worst.add(ulpError(f(x), evaluate(exact, x)), x);
  worst.expectWithin(most);
}

#define PIKO_CHECK(NAME)                                                       \
  TEST(MathBound, NAME##OfHardArguments) {                                     \
    checkHard([](float x) { return piko::NAME(x); }, mpfr_##NAME);             \
  }                                                                            \
  TEST(MathBound, NAME##OfAllFloats) {                                         \
    checkAllFloats([](float x) { return piko::NAME(x); },                      \
                   [](double x) { return std::NAME(x); });                     \
  }
PIKO_CHECK(exp)
PIKO_CHECK(exp2)
PIKO_CHECK(log)
PIKO_CHECK(log2)
PIKO_CHECK(log10)
PIKO_CHECK(sin)
PIKO_CHECK(cos)
PIKO_CHECK(tan)
PIKO_CHECK(asin)
PIKO_CHECK(acos)
PIKO_CHECK(atan)
PIKO_CHECK(sinh)
PIKO_CHECK(cosh)
PIKO_CHECK(tanh)
PIKO_CHECK(cbrt)
#undef PIKO_CHECK

// Where a stage allows more.
#define PIKO_CHECK_NEAR(NAME, ULPS)                                            \
  TEST(MathBound, NAME##Within##ULPS##OfHardArguments) {                       \
    checkHard([](float x) { return piko::within::NAME<ULPS>(x); },             \
              mpfr_##NAME, ULPS);                                              \
  }                                                                            \
  TEST(MathBound, NAME##Within##ULPS##OfAllFloats) {                           \
    checkAllFloats([](float x) { return piko::within::NAME<ULPS>(x); },        \
                   [](double x) { return std::NAME(x); }, ULPS);               \
  }
#define PIKO_CHECK(NAME) PIKO_CHECK_NEAR(NAME, 1) PIKO_CHECK_NEAR(NAME, 4)
PIKO_CHECK(exp)
PIKO_CHECK(exp2)
PIKO_CHECK(log)
PIKO_CHECK(log10)
PIKO_CHECK(sin)
PIKO_CHECK(cos)
#undef PIKO_CHECK
PIKO_CHECK_NEAR(log2, 4)
#undef PIKO_CHECK_NEAR

TEST(MathBound, rsqrtOfHardArguments) {
  checkHard([](float x) { return x == 0 ? INFINITY : piko::rsqrt(x); },
            mpfr_rec_sqrt); // whose result for -0 is not IEEE's
}
TEST(MathBound, rsqrtOfAllFloats) {
  checkAllFloats([](float x) { return piko::rsqrt(x); },
                 [](double x) { return 1 / std::sqrt(x); });
}

//===----------------------------------------------------------------------===//
// Two arguments
//===----------------------------------------------------------------------===//

template <class F, class Draw>
void checkPairs(F f, Mpfr2 exact, int count, Draw draw, double most = bound) {
  Worst worst;
  auto check = [&](float x, float y) {
    worst.add(ulpError(f(x, y), evaluate(exact, x, y)), x, y);
  };
  for (float x : makeSpecialArguments())
    for (float y : makeSpecialArguments())
      check(x, y);
  std::mt19937 random(2);
  auto any = [&] {
    return std::bit_cast<float>(static_cast<uint32_t>(random()));
  };
  for (int i = 0; i < count; ++i) {
    check(any(), any());
    auto [x, y] = draw(random);
    check(x, y);
  }
  worst.expectWithin(most);
}

/// A power that is finite, of a number of any size or next to 1.
std::pair<float, float> drawPower(std::mt19937 &random) {
  std::uniform_real_distribution<float> exponent(-151, 129), unit(-1, 1);
  uint32_t bits = static_cast<uint32_t>(random());
  float x = std::bit_cast<float>(bits & 0x7fffffffu);
  if (bits >> 31) {
    float close = unit(random);
    x = 1 + close * close * close * close * close;
  }
  return {x, exponent(random) / std::log2(x)};
}

TEST(MathBound, pow) {
  checkPairs([](float x, float y) { return piko::pow(x, y); }, mpfr_pow, 60000,
             drawPower);
}
TEST(MathBound, powWithin1) {
  checkPairs([](float x, float y) { return piko::detail::pow(x, y, true); },
             mpfr_pow, 60000, drawPower, 1);
}

/// Numbers of like size.
std::pair<float, float> drawPoint(std::mt19937 &random) {
  std::uniform_real_distribution<float> unit(-1, 1);
  std::uniform_int_distribution<int> exponent(-149, 127);
  int e = exponent(random);
  return {std::ldexp(unit(random), e), std::ldexp(unit(random), e)};
}

TEST(MathBound, atan2) {
  checkPairs([](float y, float x) { return piko::atan2(y, x); }, mpfr_atan2,
             60000, drawPoint);
}
TEST(MathBound, hypot) {
  checkPairs([](float x, float y) { return piko::hypot(x, y); }, mpfr_hypot,
             60000, drawPoint);
}

} // namespace
