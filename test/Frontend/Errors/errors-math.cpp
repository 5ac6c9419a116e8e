// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Transcendental functions of doubles, meant or by promotion, are errors at the
// call, as are functions of the C library that Piko does not have.
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=DOUBLE
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=PROMOTED
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=VECTOR
// RUN: not piko-translate --cpp-to-piko -DCASE=4 %s 2>&1 | FileCheck %s --check-prefix=LIBRARY
// RUN: not piko-translate --cpp-to-piko -DCASE=5 %s 2>&1 | FileCheck %s --check-prefix=RESULTS
#include <piko.h>

#include <cmath>

struct A {
  float x;
  double y;
};
struct State {
  piko::Buffer<A> buffer;
};
struct Stage : piko::Stage<0, 0, 1, A>, piko::Uses<State> {
  void process(const A &a) {
    A &out = state().buffer[0];
#if CASE == 1
    // DOUBLE: errors-math.cpp:[[#@LINE + 1]]:13: error: not supported in Piko: 'pow' of a double: Piko has only that of a float
    out.y = std::pow(a.y, 0.3);
#elif CASE == 2
    // PROMOTED: errors-math.cpp:[[#@LINE + 1]]:13: error: not supported in Piko: 'sin' of a double: Piko has only that of a float
    out.x = ::sin(a.x);
#elif CASE == 3
    // VECTOR: errors-math.cpp:[[#@LINE + 1]]:13: error: not supported in Piko: 'exp' of a double: Piko has only that of a float
    out.y = glm::exp(glm::dvec3(a.y)).y;
#elif CASE == 4
    // LIBRARY: errors-math.cpp:[[#@LINE + 1]]:13: error: not supported in Piko: a call of 'erff', which has no body in this file
    out.x = std::erf(a.x);
#else
    int exponent;
    // RESULTS: errors-math.cpp:[[#@LINE + 1]]:20: error: not supported in Piko: 'frexp' of a long double: Piko has only that of a float or a double
    out.y = double(std::frexp(static_cast<long double>(a.y), &exponent));
#endif
  }
};
struct Pipeline : piko::Pipe<State> {
  Stage stage;
  Pipeline() { source(stage); }
};
