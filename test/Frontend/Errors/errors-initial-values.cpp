// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An initial value that is not known when the pipeline is compiled is reported
// at the member, with a note at what cannot be evaluated.
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=OUTSIDE
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=LARGE
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=PIXEL
#include <array>
#include <piko.h>

inline int counter = 3;
template <int N> std::array<int, N> fill() {
  std::array<int, N> values{};
  for (int &value : values)
    // OUTSIDE: errors-initial-values.cpp:[[#@LINE + 2]]:14: error: not supported in Piko: access to the variable 'counter', which is outside the pipeline
    // LARGE-DAG: errors-initial-values.cpp:[[#@LINE + 1]]:14: note: read of non-const variable 'counter' is not allowed in a constant expression
    value += counter;
  return values;
}
struct Pixel {
  float near = 1, far;
  // PIXEL: errors-initial-values.cpp:[[#@LINE + 1]]:21: error: not supported in Piko: access to the variable 'counter', which is outside the pipeline
  Pixel() : far(2 * counter) {}
};
struct State {
#if CASE == 1
  std::array<int, 8> values = fill<8>();
#elif CASE == 2
  // LARGE-DAG: errors-initial-values.cpp:[[#@LINE + 1]]:25: error: expected the initial value of 'values', of 5000 numbers, to be a constant expression
  std::array<int, 5000> values = fill<5000>();
#else
  piko::Image<Pixel> pixels;
#endif
  piko::Buffer<int> out;
};
struct Stage : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) { state().out[i] = i; }
};
struct P : piko::Pipe<State> {
  Stage stage;
  P() { source(stage); }
};
