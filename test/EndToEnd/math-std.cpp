// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Functions of the C++ library and of GLM on numbers. The reference takes
// piko's in the place of those that differ between machines, as the compiler
// does; the others have one right value.
// RUN: piko-compare %s --count 64 --runs 1 --threads 1 2>/dev/null | FileCheck %s
// CHECK: equal
#include "Inputs/functions.h"

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
