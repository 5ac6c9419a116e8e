// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Tests for any set of classes of numbers, which LLVM makes of comparisons with
// bounds, on input with infinities, NaNs, zeros and denormals.
// RUN: %compare_targets %s --count 3000 --wide | FileCheck %s
// CHECK: equal
#include <piko.h>

#include <utility>

struct Number {
  float x;
  double y;
  int serial;
};
struct Classes {
  uint64_t single, wide;
  float logarithm;
};
struct State {
  piko::Buffer<Classes> classes;
};

// Signalling and quiet NaNs together are the lowest two bits.
template <unsigned Index, class T> uint64_t test(T x) {
  constexpr unsigned mask = Index * 37 % 256 * 4 + Index % 2 * 3;
  return uint64_t(__builtin_isfpclass(x, mask)) << Index;
}
template <class T, unsigned... Index>
uint64_t testAll(T x, std::integer_sequence<unsigned, Index...>) {
  return (test<Index>(x) | ...);
}

struct Classify : piko::Stage<0, 0, 64, Number>, piko::Uses<State> {
  void process(const Number &n) {
    auto indices = std::make_integer_sequence<unsigned, 64>();
    state().classes[n.serial] = {testAll(n.x, indices), testAll(n.y, indices),
                                 piko::log2(n.x)};
  }
};
struct FloatClasses : piko::Pipe<State> {
  Classify classify;
  FloatClasses() {
    source(classify);
    allocateForSource(state().classes, 0);
  }
};
