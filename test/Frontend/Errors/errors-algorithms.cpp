// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Algorithms that Piko does not have, and what to write instead.
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=SORT
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=RANGES
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=STABLE
// RUN: not piko-translate --cpp-to-piko -DCASE=4 %s 2>&1 | FileCheck %s --check-prefix=BYTES
// RUN: not piko-translate --cpp-to-piko -DCASE=5 %s 2>&1 | FileCheck %s --check-prefix=MEMBERS
// RUN: not piko-translate --cpp-to-piko -DCASE=6 %s 2>&1 | FileCheck %s --check-prefix=POINTERS
// RUN: not piko-translate --cpp-to-piko -DCASE=7 %s 2>&1 | FileCheck %s --check-prefix=PARTS
// RUN: piko-translate --cpp-to-piko -DCASE=8 %s | FileCheck %s --check-prefix=PARTIAL
#include <algorithm>
#include <atomic>
#include <cstring>
#include <piko.h>

struct A {
  int x, y;
};
struct Sorter : piko::Stage<0, 0, 1, A, A> {
  void process(const A &a) {
    int k[6] = {a.x, 2, a.y, 7, 1, 9};
    A out = a;
#if CASE == 1
    // SORT: errors-algorithms.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: recursion: 'std::__introsort_loop' calls itself, in a call of 'std::sort'; use std::partial_sort up to the end of the range, or sort(key) in a parallelFor{{$}}
    std::sort(k, k + 6);
#elif CASE == 2
    // RANGES: errors-algorithms.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: recursion: {{.*}}; use std::partial_sort up to the end of the range, or sort(key) in a parallelFor{{$}}
    std::ranges::sort(k);
#elif CASE == 3
    // STABLE: errors-algorithms.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: dynamic allocation, in a call of 'std::stable_sort'; use std::partial_sort up to the end of the range, or sort(key) in a parallelFor{{$}}
    std::stable_sort(k, k + 6);
#elif CASE == 4
    // BYTES: errors-algorithms.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: copying or filling a number of bytes that varies, of which it is not known that they are whole elements of one type; write a loop over the elements{{$}}
    std::memcpy(k, k + 3, a.x & 7);
#elif CASE == 5
    // After the first array there is another one.
    struct Two {
      int first[4];
      float second[4];
    } from = {}, to = {};
    // MEMBERS: errors-algorithms.cpp:[[#@LINE + 1]]:5: error: not supported in Piko: copying or filling a number of bytes that varies, of which it is not known that they are whole elements of one type; write a loop over the elements{{$}}
    std::memcpy(&to, &from, (a.x & 7) * sizeof(int));
    out.x = to.first[a.x & 3] + from.first[a.y & 3];
#elif CASE == 6
    for (int *p : {&out.x, &out.y, &k[0], &k[1], &k[2]})
      // POINTERS: errors-algorithms.cpp:[[#@LINE + 1]]:10: error: not supported in Piko: access through a pointer that can point to different places; use an index, or a branch for each place{{$}}
      *p += 1;
#elif CASE == 7
    std::atomic<int> n = 0;
    // PARTS: errors-algorithms.cpp:[[#@LINE - 1]]:26: error: not supported in Piko: a local variable 'n' whose parts are accessed in ways that cannot be told apart, in stage 'sorter'; access its members by name and its arrays by index{{$}}
    n.fetch_add(1);
    out.x = n.load();
#else
    // What the messages say to use.
    // PARTIAL: piko.emit
    std::partial_sort(k, k + 6, k + 6);
#endif
    out.y = k[3];
    emit(out);
  }
};
struct Drain : piko::Stage<0, 0, 1, A> {
  void process(const A &) {}
};
struct Pipeline : piko::Pipe<> {
  Sorter sorter;
  Drain drain;
  Pipeline() {
    source(sorter);
    connect(sorter, 0, drain);
  }
};
