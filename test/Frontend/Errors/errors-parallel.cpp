// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What iterations may not do is said where they do it.
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=SUM
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=MEMBER
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=ONCE
// RUN: not piko-translate --cpp-to-piko -DCASE=4 %s 2>&1 | FileCheck %s --check-prefix=INNER
// RUN: not piko-translate --cpp-to-piko -DCASE=5 %s 2>&1 | FileCheck %s --check-prefix=NESTED
// RUN: not piko-translate --cpp-to-piko -DCASE=6 %s 2>&1 | FileCheck %s --check-prefix=OUTSIDE
// RUN: not piko-translate --cpp-to-piko -DCASE=7 %s 2>&1 | FileCheck %s --check-prefix=ASSIGN
// RUN: not piko-translate --cpp-to-piko -DCASE=8 %s 2>&1 | FileCheck %s --check-prefix=UPDATE
// RUN: not piko-translate --cpp-to-piko -DCASE=9 %s 2>&1 | FileCheck %s --check-prefix=COMBINE
// RUN: not piko-translate --cpp-to-piko -DCASE=10 %s 2>&1 | FileCheck %s --check-prefix=LEAVES
// RUN: not piko-translate --cpp-to-piko -DCASE=11 %s 2>&1 | FileCheck %s --check-prefix=ENDLESS
// RUN: not piko-translate --cpp-to-piko -DCASE=12 %s 2>&1 | FileCheck %s --check-prefix=ATOMIC
// RUN: not piko-translate --cpp-to-piko -DCASE=13 %s 2>&1 | FileCheck %s --check-prefix=COPY
// RUN: not piko-translate --cpp-to-piko -DCASE=14 %s 2>&1 | FileCheck %s --check-prefix=COPIES
#include <piko.h>

struct A {
  float x;
  int n;
};
struct State {
  piko::Buffer<A> buffer;
  piko::Image<A> image;
};

struct Stage : piko::Stage<0, 0, 64, A>, piko::Uses<State> {
  void assignBin(const A &a) {
#if CASE == 7
    // ASSIGN: errors-parallel.cpp:[[#@LINE + 1]]:5: error: expected parallelFor in a process phase, but stage 'stage' has one in another
    parallelFor(a.n, [&](int) { assignToAll(a); });
#endif
    assignToAll(a);
  }
  void process(const A &a) {
    float sum = 0;
    int counts[4] = {};
    glm::vec3 vector(0);
    // NESTED: errors-parallel.cpp:[[#@LINE + 21]]:33: error: expected sync inside a parallelFor that is not nested
    // NESTED: errors-parallel.cpp:[[#@LINE + 1]]:5: note: the outer parallelFor is here
    parallelFor(a.n, [&](int i) {
      float own = 0;
#if CASE == 1
      // SUM: errors-parallel.cpp:[[#@LINE + 1]]:11: error: expected the iterations of parallelFor to be independent, but this one assigns the captured variable 'sum'
      sum += float(i);
#elif CASE == 2
      // MEMBER: errors-parallel.cpp:[[#@LINE + 1]]:16: error: expected the iterations of parallelFor to be independent, but this one assigns the captured variable 'vector'
      vector.y = float(i);
#elif CASE == 3
      // ONCE: errors-parallel.cpp:[[#@LINE + 2]]:13: error: expected the iterations of parallelFor to be independent, but this one assigns the captured variable 'sum'
      if (i == 3)
        sum = 7;
#elif CASE == 4
      // INNER: errors-parallel.cpp:[[#@LINE + 1]]:39: error: expected the iterations of parallelFor to be independent, but this one assigns the captured variable 'own'
      parallelFor(3, [&](int j) { own = float(j); });
#elif CASE == 12
      // ATOMIC: errors-parallel.cpp:[[#@LINE + 1]]:7: error: expected the iterations of parallelFor to be independent, but this one changes the captured variable 'counts' atomically
      piko::atomicAdd(counts[i % 4], 1);
#elif CASE == 5
      parallelFor(3, [&](int) { sync(); });
#elif CASE == 8
      // UPDATE: errors-parallel.cpp:[[#@LINE + 1]]:55: error: not supported in Piko: a barrier inside an update
      update(state().image, glm::ivec2(i), [&](A &) { sync(); });
#elif CASE == 9
      own = reduce(i, [&](int b, int c) {
        // COMBINE: errors-parallel.cpp:[[#@LINE + 1]]:27: error: not supported in Piko: a change of the state inside the function of a reduction
        state().buffer[i] = a;
        return b + c;
      });
#elif CASE == 10
      // LEAVES: errors-parallel.cpp:[[#@LINE + 1]]:7: error: expected the function of a reduction to do nothing but combine two values
      reduce(i, [&](int b, int c) {
        own = float(b);
        return b + c;
      });
#elif CASE == 11
      // ENDLESS: errors-parallel.cpp:[[#@LINE + 1]]:7: error: expected a loop that can end, but nothing leaves this one
      while (true)
        ;
#endif
      state().buffer[i].x = own;
    });
#if CASE == 6
    // OUTSIDE: errors-parallel.cpp:[[#@LINE + 1]]:5: error: expected sync inside a parallelFor, but stage 'stage' has one outside
    sync();
#elif CASE == 13
    // COPY: errors-parallel.cpp:[[#@LINE + 2]]:47: error: expected the iterations of parallelFor to be independent, but this one assigns a variable captured by value, of which all share one copy
    // COPY: errors-parallel.cpp:[[#@LINE + 1]]:47: note: a variable that the iteration declares is its own; reduce, count and atomics on state combine what iterations find
    parallelFor(a.n, [=](int i) mutable { sum += float(i); });
#elif CASE == 14
    // COPIES: errors-parallel.cpp:[[#@LINE + 1]]:57: error: expected the iterations of parallelFor to be independent, but this one assigns a variable captured by value, of which all share one copy
    parallelFor(a.n, [vector](int i) mutable { vector.y = float(i); });
#endif
    state().buffer[a.n].x = sum + vector.y;
  }
};
struct Pipeline : piko::Pipe<State> {
  Stage stage;
  Pipeline() { source(stage); }
};
