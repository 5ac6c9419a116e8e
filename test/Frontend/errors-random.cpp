// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: not piko-translate --cpp-to-piko %s 2>&1 | FileCheck %s
#include <piko.h>

#include <random>
struct D {
  int a;
};
struct S {
  piko::Buffer<int> o;
};
struct T : piko::Stage<0, 0, 1, D>, piko::Uses<S> {
  void process(const D &d) {
    std::mt19937 g(d.a);
    // CHECK: errors-random.cpp:[[@LINE+1]]:{{[0-9]+}}: error: not supported in Piko: an index that is computed
    state().o[0] = int(g());
  }
};
struct P : piko::Pipe<S> {
  T t;
  P() { source(t); }
};
