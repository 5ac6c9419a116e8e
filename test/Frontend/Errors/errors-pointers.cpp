// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Pointers of which it is not known where they point, and what to write
// instead.
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=COMPARE
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=DISTANCE
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=TABLE
// RUN: not piko-translate --cpp-to-piko -DCASE=4 %s 2>&1 | FileCheck %s --check-prefix=LITERAL
// RUN: not piko-translate --cpp-to-piko -DCASE=5 %s 2>&1 | FileCheck %s --check-prefix=EQUAL
// RUN: not piko-translate --cpp-to-piko -DCASE=6 %s 2>&1 | FileCheck %s --check-prefix=BYTES
// RUN: not piko-translate --cpp-to-piko -DCASE=7 %s 2>&1 | FileCheck %s --check-prefix=BEST
// RUN: not piko-translate --cpp-to-piko -DCASE=9 %s 2>&1 | FileCheck %s --check-prefix=CALLEE
// RUN: piko-translate --cpp-to-piko -DCASE=8 %s | FileCheck %s --check-prefix=INSTEAD
#include <piko.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

struct A {
  int x, y;
  float z;
};
// The end of `c` may be the place of a base class after it: both are a step
// over bytes.
struct Bytes {
  signed char c[4];
  signed char d[4];
};

struct Stage : piko::Stage<0, 0, 1, A, A> {
#if CASE == 9
  static float partOf(const A &a, int i) {
    glm::vec4 v(a.x, a.y, a.z, 1);
    const float *parts = &v.x;
    // CALLEE: errors-pointers.cpp:[[#@LINE + 1]]:12: error: not supported in Piko: a local variable 'v' whose parts are accessed in ways that cannot be told apart, in stage 'stage'; access its members by name and its arrays by index{{$}}
    return parts[i];
  }
#endif
  void process(const A &a) {
    int k[4] = {a.x, 2, a.y, 7}, l[4] = {1, a.y, 3, a.x};
    int i = a.x & 3;
    A out = a;
#if CASE == 1
    // COMPARE: errors-pointers.cpp:[[#@LINE + 1]]:14: error: not supported in Piko: a pointer that can point to different places; use an index, or a branch for each place{{$}}
    int *q = a.y > 3 ? &k[i] : &l[i];
    out.x = q == &k[a.y & 3];
#elif CASE == 2
    // DISTANCE: errors-pointers.cpp:[[#@LINE + 1]]:19: error: not supported in Piko: comparing or subtracting pointers that are not known to point into one array; compare indices{{$}}
    out.x = &k[i] - &l[a.y & 3];
#elif CASE == 3
    float (*functions[])(float) = {sinf, cosf};
    // TABLE: errors-pointers.cpp:[[#@LINE + 1]]:13: error: not supported in Piko: a virtual call or a call through a pointer; use a switch that calls each function by its name{{$}}
    out.z = functions[i & 1](a.z);
#elif CASE == 4
    // LITERAL: errors-pointers.cpp:[[#@LINE + 1]]:29: error: not supported in Piko: a call of 'strlen', {{.*}}; write the literal with its length, as in "text"sv{{$}}
    std::string_view text = "text";
    out.x = text[i];
#elif CASE == 5
    // EQUAL: errors-pointers.cpp:[[#@LINE + 1]]:13: error: not supported in Piko: a call of 'memcmp', {{.*}}; write a loop over the elements{{$}}
    out.x = std::memcmp(k, l, sizeof k);
#elif CASE == 6
    // BYTES: errors-pointers.cpp:[[#@LINE + 2]]:5: error: not supported in Piko: a local variable 'bytes' whose parts are accessed in ways that cannot be told apart, in stage 'stage'; access its members by name and its arrays by index{{$}}
    Bytes bytes = {{1, 2, 3, 4}, {5, 6, 7, 8}};
    bytes.c[i] = a.y;
    out.x = *(std::end(bytes.c) - i - 1) + bytes.d[i];
#elif CASE == 7
    A all[5] = {a, {a.y, a.x, 3}, a, a, a};
    A *best = nullptr;
    for (A &one : all)
      if (one.x > a.x && (!best || one.y > best->y))
        best = &one;
    // BEST: errors-pointers.cpp:[[#@LINE + 1]]:18: error: not supported in Piko: comparing or subtracting pointers that are not known to point into one array; compare indices{{$}}
    out.x = best == &all[1];
#elif CASE == 9
    // CALLEE: errors-pointers.cpp:[[#@LINE + 1]]:13: note: called from here{{$}}
    out.z = partOf(a, i);
#else
    // What the messages say to use.
    // INSTEAD: piko.emit
    using namespace std::literals;
    auto text = "text"sv;
    for (char c : text)
      out.x += c + text[i];
    switch (i & 1) {
    case 0:
      out.z = sinf(a.z);
      break;
    default:
      out.z = cosf(a.z);
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
