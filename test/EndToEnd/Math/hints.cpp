// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What only tells an optimizer what to expect changes nothing.
// RUN: %compare_targets %s --count 64 --runs 1 --threads 1 | FileCheck %s
// CHECK: equal
#include "../Inputs/functions.h"

#include <memory>
#include <numeric>

enum class Kind { A, B, C };

struct Hints {
  static int choose(Kind kind) {
    switch (kind) {
    [[likely]] case Kind::A:
      return 3;
    case Kind::B:
      return 5;
    [[unlikely]] case Kind::C:
      return 7;
    }
    __builtin_unreachable();
  }
  static void call(auto put, int i, float x, float y, float z) {
    int n = 0;
    if (x > y) [[unlikely]]
      n += 1;
    else [[likely]]
      n += 2;
    if (__builtin_expect(x > z, 0))
      n += 4;
    if (__builtin_expect_with_probability(y > z, 1, 0.9))
      n += 8;
    n += int(__builtin_expect(long(i), 5L));
    while (n % 7 != 3) [[likely]]
      ++n;
    for (int k = 0; k < 3; ++k) [[unlikely]]
      n += k;
#ifdef __clang__
    __builtin_assume(i >= 0);
    [[clang::assume(i < 1 << 30)]];
#else
    [[gnu::assume(i >= 0)]];
#endif
    float *aligned = std::assume_aligned<4>(&x);
    n += choose(Kind(i % 3));
    switch (i % 2) {
    case 0:
      n += 16;
      break;
    case 1:
      n += 32;
      break;
    default:
      __builtin_unreachable();
    }
    put(n, *aligned);
    put(std::midpoint(x, y), std::midpoint(double(x), double(z)),
        std::midpoint(i, 7), std::midpoint(i, -9),
        std::midpoint(uint64_t(i), uint64_t(3)));
    put(std::gcd(i, 36), std::lcm(i % 100, 6));
  }
};
struct Pipeline : piko::Pipe<State> {
  Call<Hints> hints;
  Pipeline() { source(hints); }
};
