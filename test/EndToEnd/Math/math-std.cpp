// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Functions of the C++ library and of GLM on numbers. The reference takes
// piko's in the place of those that differ between machines, as the compiler
// does; the others have one right value.
// RUN: %compare_targets %s --count 64 --runs 1 --threads 1 2>/dev/null | FileCheck %s
// CHECK: equal
#include "../Inputs/functions.h"

#include <climits>
#include <cmath>

#ifdef __PIKO__
namespace library = std;
namespace shader = glm;
#else
namespace library = piko;
namespace shader = piko;
#endif

struct Functions {
  static void call(auto put, int i, float x, float y, float z) {
    put(library::exp(x), library::exp2(x), library::log(x), library::log2(x),
        library::log10(x), library::pow(x, y), library::sin(x), library::cos(x),
        library::tan(x), library::asin(x), library::acos(x), library::atan(x),
        library::atan2(x, y), library::sinh(x), library::cosh(x),
        library::tanh(x), library::cbrt(x), library::hypot(x, y));
    put(shader::exp(y), shader::exp2(y), shader::log(y), shader::log2(y),
        shader::pow(y, z), shader::sin(y), shader::cos(y), shader::tan(y),
        shader::asin(y), shader::acos(y), shader::atan(y), shader::sinh(y),
        shader::cosh(y), shader::tanh(y));
    put(std::floor(x), std::ceil(x), std::trunc(x), std::round(x),
        std::nearbyint(x), std::rint(x), std::abs(x), std::copysign(x, y),
        std::sqrt(x), std::fma(x, y, z), std::fmod(x, y), std::fdim(x, y),
        std::fmin(x, y), std::fmax(x, y));
    put(std::ldexp(x, i % 300 - 150), std::scalbn(x, -i));
  }
};
/// Doubles of all sizes, among them denormals, and near halves.
double makeDouble(int i, float x) {
  if (i % 3 == 0)
    return double(x) * 1.0000001;
  uint64_t bits = mix(uint32_t(i));
  bits = bits << 32 | mix(uint32_t(bits) + 1);
  if (i % 3 == 1)
    return std::bit_cast<double>(bits);
  double sign = bits & 1 ? -1.0 : 1.0;
  return bits & 2
             ? sign * double(bits % 4096) * 0x1p-1074
             : sign * (double(bits % 4096) * 0.5 + double(bits % 3) * 0x1p-44);
}
void putDoubles(auto put, int i, float x, float y) {
  double a = makeDouble(i, x), b = makeDouble(i + 1, y);
  int exponent = 0;
  double whole;
  put(std::fdim(a, b), std::ldexp(a, i % 300 - 150),
      std::ldexp(a, (i * 37) % 4400 - 2200), std::scalbn(b, INT_MAX - i),
      std::scalbn(b, INT_MIN + i), std::frexp(a, &exponent));
  put(std::isfinite(a) ? exponent : 0, std::modf(b, &whole), whole);
  double small = std::fabs(a) < 1e18 ? a : double(i) + 0.5;
  put(std::lround(small), std::lrint(small), std::llround(small),
      std::llrint(small));
  glm::dvec2 v(a, b);
  glm::dvec2 sum = glm::floor(v) + glm::ceil(v) + glm::round(v) + glm::sqrt(v) +
                   glm::trunc(v) + glm::abs(v) + glm::sign(v);
  put(sum.x, sum.y, glm::fract(a), glm::mod(a, b), glm::fract(v).y,
      glm::mod(v, glm::dvec2(b, a)).x, glm::mix(v, sum, 0.25).y,
      glm::roundEven(a), glm::inversesqrt(v).x, glm::length(v),
      glm::smoothstep(0.0, 1.0, a), glm::step(v, sum).x, glm::min(v, sum).x,
      glm::fma(a, b, a));
  // Through a pointer, as GLM calls them.
  auto apply = [&](double (*function)(double)) { return function(a); };
  put(apply(std::floor), apply(std::ceil), apply(std::sqrt), apply(std::rint),
      apply(std::fabs), apply(std::nearbyint));
}
struct Tests {
  static void call(auto put, int i, float x, float y, float z) {
    int exponent;
    float whole;
    put(std::frexp(x, &exponent));
    put(std::isfinite(x) ? exponent : 0);
    put(std::modf(x, &whole));
    put(whole);
    float small = float(i) * 0.3f - 999.5f;
    put(std::lround(small), std::lrint(small), std::llround(small),
        std::llrint(small));
    put(std::isnan(x), std::isinf(x), std::isfinite(x), std::isnormal(x),
        std::signbit(x), std::fpclassify(x), std::isless(x, y),
        std::isunordered(x, y), x <= 0.0f || std::isnan(x),
        x > 0.0f && std::isfinite(x), __builtin_isfpclass(x, 0x2a9));
    double u = x, v = double(y) * 1.0000001;
    put(std::floor(u), std::ceil(v), std::trunc(v), std::round(v), std::abs(u),
        std::sqrt(v), std::fma(u, v, v), std::fmod(u, v), std::fmin(u, v),
        std::fmax(u, v), std::isnan(v));
    putDoubles(put, i, x, y);
    uint32_t bits = mix(static_cast<uint32_t>(i));
    put(std::popcount(bits), std::countl_zero(bits), std::countr_zero(bits),
        std::rotl(bits, i & 31), std::bit_width(bits), std::bit_floor(bits),
        std::bit_ceil(bits >> 1));
  }
};
struct Pipeline : piko::Pipe<State> {
  Call<Functions> functions;
  Call<Tests> tests;
  Pipeline() {
    source(functions);
    source(tests);
  }
};
