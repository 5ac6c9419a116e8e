// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Distributions of <random>, and what to write instead.
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=INT
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=REAL
// RUN: piko-translate --cpp-to-piko -DCASE=3 %s | FileCheck %s --check-prefix=ENGINE
#include <piko.h>

#include <random>
struct D {
  int a;
};
struct S {
  piko::Buffer<float> o;
};
struct T : piko::Stage<0, 0, 1, D>, piko::Uses<S> {
  void process(const D &d) {
    std::mt19937 g(d.a);
#if CASE == 1
    // INT: errors-random.cpp:[[#@LINE + 1]]:20: error: not supported in Piko: recursion: {{.*}}; compute it from what the engine gives, as in g() % 6 + 1 and float(g() >> 8) * 0x1p-24f{{$}}
    state().o[0] = std::uniform_int_distribution<int>(1, 6)(g);
#elif CASE == 2
    // REAL: errors-random.cpp:[[#@LINE + 1]]:20: error: not supported in Piko: 'log' of a long double: {{.*}}; compute it from what the engine gives, as in g() % 6 + 1 and float(g() >> 8) * 0x1p-24f{{$}}
    state().o[0] = std::uniform_real_distribution<float>(0, 1)(g);
#else
    // ENGINE: piko.store
    state().o[0] = g() % 6 + 1 + float(g() >> 8) * 0x1p-24f;
#endif
  }
};
struct P : piko::Pipe<S> {
  T t;
  P() { source(t); }
};
