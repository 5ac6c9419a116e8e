// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What Piko does not have is said at the place that needs it, one error a run.
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=THROW
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=RECURSION
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=NEW
// RUN: not piko-translate --cpp-to-piko -DCASE=4 %s 2>&1 | FileCheck %s --check-prefix=NOBODY
// RUN: not piko-translate --cpp-to-piko -DCASE=5 %s 2>&1 | FileCheck %s --check-prefix=GLOBAL
// RUN: not piko-translate --cpp-to-piko -DCASE=6 %s 2>&1 | FileCheck %s --check-prefix=MEMBER
// RUN: not piko-translate --cpp-to-piko -DCASE=7 %s 2>&1 | FileCheck %s --check-prefix=CONSTANT
// RUN: not piko-translate --cpp-to-piko -DCASE=8 %s 2>&1 | FileCheck %s --check-prefix=ASM
// RUN: not piko-translate --cpp-to-piko -DCASE=9 %s 2>&1 | FileCheck %s --check-prefix=PORT
// RUN: not piko-translate --cpp-to-piko -DCASE=10 %s 2>&1 | FileCheck %s --check-prefix=NESTED
// RUN: not piko-translate --cpp-to-piko -DCASE=11 %s 2>&1 | FileCheck %s --check-prefix=BRANCH
// RUN: not piko-translate --cpp-to-piko -DCASE=12 %s 2>&1 | FileCheck %s --check-prefix=ENDLESS
// RUN: not piko-translate --cpp-to-piko -DCASE=13 %s 2>&1 | FileCheck %s --check-prefix=VIRTUAL
// RUN: not piko-translate --cpp-to-piko -DCASE=14 %s 2>&1 | FileCheck %s --check-prefix=SYNTAX
// RUN: not piko-translate --cpp-to-piko -DCASE=15 %s 2>&1 | FileCheck %s --check-prefix=PLAIN
// RUN: not piko-translate --cpp-to-piko -DCASE=16 %s 2>&1 | FileCheck %s --check-prefix=COUNTDOWN
// RUN: not piko-translate --cpp-to-piko -DCASE=17 %s 2>&1 | FileCheck %s --check-prefix=BIG
// RUN: not piko-translate --cpp-to-piko -DCASE=18 %s 2>&1 | FileCheck %s --check-prefix=LONG
// RUN: not piko-translate --cpp-to-piko -DCASE=19 %s 2>&1 | FileCheck %s --check-prefix=OBJECT
#include <piko.h>

struct A {
  float x;
};
struct State {
  float constant;
  piko::Buffer<A> buffer;
  piko::Image<A> image;
};
// RECURSION: errors-unsupported.cpp:[[#@LINE + 1]]:50: error: not supported in Piko: recursion: 'fibonacci' calls itself
inline int fibonacci(int n) { return n < 2 ? n : fibonacci(n - 1); }
float outside(float);
int counter;
struct Shape {
  virtual float area() const = 0;
};
// VIRTUAL: errors-unsupported.cpp:[[#@LINE + 1]]:58: error: not supported in Piko: a virtual call or a call through a pointer; use a switch that calls each function by its name
inline float getArea(const Shape *shape) { return shape->area(); }

struct Square : Shape {
  float side;
  float area() const override { return side * side; }
};

struct Stage : piko::Stage<0, 0, 1, A, A>, piko::Uses<State> {
  int member = 0;

  void process(const A &a) {
    A &out = state().buffer[0];
#if CASE == 1
    // THROW: errors-unsupported.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: exceptions
    throw 1;
#elif CASE == 2
    out.x = fibonacci(int(a.x));
#elif CASE == 3
    // NEW: errors-unsupported.cpp:[[#@LINE + 1]]:14: error: not supported in Piko: dynamic allocation
    out.x = *new float(a.x);
#elif CASE == 4
    // NOBODY: errors-unsupported.cpp:[[#@LINE + 1]]:13: error: not supported in Piko: a call of 'outside', which has no body in this file
    out.x = outside(a.x);
#elif CASE == 5
    // GLOBAL: errors-unsupported.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: access to the variable 'counter', which is outside the pipeline
    ++counter;
#elif CASE == 6
    // MEMBER: errors-unsupported.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: changing a member of a stage in a phase, whose calls are concurrent
    ++member;
#elif CASE == 7
    // CONSTANT: errors-unsupported.cpp:[[#@LINE + 1]]:22: error: not supported in Piko: writing to a constant of the state
    state().constant = a.x;
#elif CASE == 8
    // ASM: errors-unsupported.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: inline assembly
    asm volatile("nop");
#elif CASE == 9
    // PORT: errors-unsupported.cpp:[[#@LINE + 1]]:5: error: expected the port of an emit to be a constant
    emit(a, int(a.x));
#elif CASE == 10
    update(state().image, glm::ivec2(0), [&](A &p) {
      // NESTED: errors-unsupported.cpp:[[#@LINE + 1]]:7: error: not supported in Piko: an update inside an update
      update(state().image, glm::ivec2(1), [&](A &q) { q.x = p.x; });
    });
#elif CASE == 11
    update(state().image, glm::ivec2(0), [&](A &p) {
      if (p.x < a.x) {
        // BRANCH: errors-unsupported.cpp:[[#@LINE + 1]]:9: error: not supported in Piko: an update inside an update
        update(state().image, glm::ivec2(1), [&](A &q) { q.x = p.x; });
      }
    });
#elif CASE == 12
    update(state().image, glm::ivec2(0), [&](A &p) {
      // ENDLESS: errors-unsupported.cpp:[[#@LINE + 1]]:7: error: expected a loop that can end, but nothing leaves this one
      for (;;)
        p.x += a.x;
    });
#elif CASE == 13
    out.x = getArea(reinterpret_cast<const Shape *>(&a));
#elif CASE == 15
    // PLAIN: errors-unsupported.cpp:[[#@LINE + 2]]:7: error: expected a loop that can end, but nothing leaves this one
    if (a.x > 7)
      while (true)
        ;
#elif CASE == 16
    // COUNTDOWN: errors-unsupported.cpp:[[#@LINE + 1]]:5: error: expected a loop that can end, but nothing leaves this one
    for (unsigned i = 10; i >= 0; --i)
      out.x += float(i);
#elif CASE == 17
    float small[1000], big[4000000];
    for (int i = 0; i < 4000000; ++i) {
      small[i % 1000] = a.x;
      // BIG: errors-unsupported.cpp:[[#@LINE + 1]]:7: error: expected the local arrays of a phase to take at most 262144 bytes, but with 'big' they take 1600
      big[i] = a.x;
    }
    out.x = big[int(a.x)] + small[int(a.x)];
#elif CASE == 18
    // LONG: errors-unsupported.cpp:[[#@LINE + 1]]:{{[0-9]+}}: error: not supported in Piko: long double; use double
    out.x = float((long double)a.x * a.x / 7 + 1);
#elif CASE == 19
    // OBJECT: error: not supported in Piko: an object of a class with virtual functions 'square'; use a switch that calls each function by its name
    // OBJECT: errors-unsupported.cpp:[[#@LINE + 1]]:12: note: called from here
    Square square;
    square.side = a.x;
    const Shape *shape = &square;
    out.x = shape->area();
#else
    // SYNTAX: errors-unsupported.cpp:[[#@LINE + 1]]:7: error: no member named 'q' in 'A'
    a.q = 1;
#endif
    (void)out;
  }
};
struct Drain : piko::Stage<0, 0, 1, A> {
  void process(const A &) {}
};
struct Pipeline : piko::Pipe<State> {
  Stage stage;
  Drain drain;
  Pipeline() {
    source(stage);
    connect(stage, 0, drain);
  }
};
