// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The functions of piko:: give the same bits as in a plain C++ build, on numbers
// of any size, denormals, infinities and NaN.
// RUN: %compare_targets %s --count 64 --runs 1 --threads 1 | FileCheck %s
// CHECK: equal
#include "../Inputs/functions.h"

struct Functions {
  static void call(auto put, int i, float x, float y, float z) {
    put(piko::exp(x), piko::exp2(x), piko::log(x), piko::log2(x),
        piko::log10(x), piko::pow(x, y), piko::sin(x), piko::cos(x),
        piko::tan(x), piko::asin(x), piko::acos(x), piko::atan(x),
        piko::atan2(x, y), piko::sinh(x), piko::cosh(x), piko::tanh(x),
        piko::cbrt(x), piko::rsqrt(x), piko::hypot(x, y));
    put(piko::sqrt(x), piko::fma(x, y, z), piko::floor(x), piko::ceil(x),
        piko::trunc(x), piko::round(x), piko::copysign(x, y), piko::abs(x),
        piko::min(x, y), piko::max(x, y), piko::clamp(x, y, z));
    put(piko::toInt(x), piko::toInt64(x), piko::toUint(x));
    put(x + y, x - y, x * y, x / y, -x);
    double u = x, v = y;
    put(u + v, u - v, u * v, u / v);
    put(x < y, x <= y, x == y, x != y, !(x < y), x == 0.0f || x != x);
    put(i + 0x7fffff00, i * i * i * i, -i >> 3, i / -7, i % -7);
  }
};
struct Pipeline : piko::Pipe<State> {
  Call<Functions> functions;
  Pipeline() { source(functions); }
};
