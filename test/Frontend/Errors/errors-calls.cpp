// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a header does that Piko does not have is an error at the user's own
// call, in the names that the user wrote. Notes show the calls that lead there,
// and those after it.
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=PUSH
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=LOOP
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=STATIC
// RUN: not piko-translate --cpp-to-piko -DCASE=4 %s 2>&1 | FileCheck %s --check-prefix=GUARD
// RUN: not piko-translate --cpp-to-piko -DCASE=5 %s 2>&1 | FileCheck %s --check-prefix=SPACE
// RUN: not piko-translate --cpp-to-piko -DCASE=6 %s 2>&1 | FileCheck %s --check-prefix=THREAD
// RUN: not piko-translate --cpp-to-piko -DCASE=7 %s 2>&1 | FileCheck %s --check-prefix=PRINTF
// RUN: not piko-translate --cpp-to-piko -DCASE=8 %s 2>&1 | FileCheck %s --check-prefix=AT
// RUN: not piko-translate --cpp-to-piko -DCASE=9 %s 2>&1 | FileCheck %s --check-prefix=CAST
// RUN: not piko-translate --cpp-to-piko -DCASE=10 %s 2>&1 | FileCheck %s --check-prefix=THROW
// RUN: not piko-translate --cpp-to-piko -DCASE=11 %s 2>&1 | FileCheck %s --check-prefix=FENCE
// RUN: not piko-translate --cpp-to-piko -DCASE=12 %s 2>&1 | FileCheck %s --check-prefix=ATOMIC
// RUN: piko-translate --cpp-to-piko -DCASE=13 %s 2>&1 | FileCheck %s --check-prefix=TRY
#include <array>
#include <atomic>
#include <cstdio>
#include <piko.h>
#include <stdexcept>
#include <vector>

struct A {
  float x;
};
namespace settings {
int calls;
}
thread_local int perThread;
struct Base {
  virtual ~Base() = default;
};
struct Derived : Base {
  float x = 1;
};
inline void append(std::vector<int> &v) {
  // PUSH: errors-calls.cpp:[[#@LINE + 2]]:5: error: not supported in Piko: dynamic allocation, in a call of 'std::vector::push_back'; use an array of a fixed size, or a buffer of the state{{$}}
  // LOOP: errors-calls.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: dynamic allocation, in a call of 'std::vector::push_back'; use an array of a fixed size, or a buffer of the state{{$}}
  v.push_back(1);
}
inline void appendTwice(std::vector<int> &v) {
  // PUSH: errors-calls.cpp:[[#@LINE + 1]]:3: note: called from here
  append(v);
  append(v);
}
// GUARD: errors-calls.cpp:[[#@LINE + 2]]:3: error: not supported in Piko: access to the variable 'first', which is outside the pipeline
inline float remember(float x) {
  static float first = x;
  return first;
}
// SPACE: errors-calls.cpp:[[#@LINE + 1]]:28: error: not supported in Piko: access to the variable 'settings::calls', which is outside the pipeline
inline void countCalls() { ++settings::calls; }

struct Stage : piko::Stage<0, 0, 1, A, A> {
  void process(const A &a) {
    A out = a;
#if CASE == 1
    std::vector<int> v;
    // PUSH: errors-calls.cpp:[[#@LINE + 4]]:5: note: called from here
    // PUSH-NOT: called from here
    // PUSH: stl_vector.h:{{.*}}: note: 'std::vector::push_back' calls 'std::vector::emplace_back' here
    // PUSH: new_allocator.h:{{.*}}: note: 'std::__new_allocator::allocate' calls 'operator new' here
    appendTwice(v);
#elif CASE == 2
    parallelFor(2, [&](int) {
      std::vector<int> v;
      // LOOP: errors-calls.cpp:[[#@LINE + 2]]:7: note: called from here
      // LOOP-NOT: called from here
      append(v);
    });
#elif CASE == 3
    static int counter;
    // STATIC: errors-calls.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: access to the variable 'counter', which is outside the pipeline
    ++counter;
#elif CASE == 4
    // GUARD: errors-calls.cpp:[[#@LINE + 1]]:13: note: called from here
    out.x = remember(a.x);
#elif CASE == 5
    // SPACE: errors-calls.cpp:[[#@LINE + 1]]:5: note: called from here
    countCalls();
#elif CASE == 6
    // THREAD: errors-calls.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: access to the variable 'perThread', which is outside the pipeline
    ++perThread;
#elif CASE == 7
    // PRINTF: errors-calls.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: a call of 'printf', which has no body in this file
    printf("%f\n", a.x);
#elif CASE == 8
    std::array<float, 4> four{};
    // AT: errors-calls.cpp:[[#@LINE + 2]]:18: error: not supported in Piko: exceptions, in a call of 'std::array::at'
    // AT: array:{{.*}}: note: 'std::array::at' calls 'std::__throw_out_of_range_fmt' here
    out.x = four.at(int(a.x));
#elif CASE == 9
    Derived derived;
    Base *base = &derived;
    // CAST: errors-calls.cpp:[[#@LINE + 1]]:13: error: not supported in Piko: run-time type information
    out.x = dynamic_cast<Derived *>(base)->x;
#elif CASE == 10
    if (a.x < 0)
      // THROW: errors-calls.cpp:[[#@LINE + 1]]:7: error: not supported in Piko: exceptions{{$}}
      throw std::runtime_error("negative");
#elif CASE == 11
    std::atomic_thread_fence(std::memory_order_seq_cst);
    // FENCE: errors-calls.cpp:[[#@LINE - 1]]:5: error: not supported in Piko: the operation 'fence'
    // FENCE: atomic_base.h:{{.*}}: note: 'std::atomic_thread_fence' does it here
#elif CASE == 12
    std::atomic<int> n = 0;
    // ATOMIC: errors-calls.cpp:[[#@LINE - 1]]:26: error: not supported in Piko: a local variable 'n' whose parts are accessed in ways that cannot be told apart
    n.fetch_add(1);
    out.x = float(n.load());
#elif CASE == 13
    // What nothing throws needs no handler.
    // TRY: piko.emit
    try {
      out.x *= 2;
    } catch (...) {
      throw;
    }
#endif
    emit(out);
  }
};
struct Drain : piko::Stage<0, 0, 1, A> {
  void process(const A &) {}
};
struct Pipeline : piko::Pipe<> {
  Stage stage;
  Drain drain;
  Pipeline() {
    source(stage);
    connect(stage, 0, drain);
  }
};
