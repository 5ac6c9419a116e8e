// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A store that all primitives, or all iterations, make to one element with values of
// their own is a data race whatever the input is. What may be none is not warned of.
// RUN: pikoc %s --emit=authored --pipe Races 2>&1 >/dev/null | FileCheck %s --implicit-check-not=warning:
// RUN: pikoc %s --emit=authored --pipe Right 2>&1 >/dev/null | FileCheck %s --check-prefix=RIGHT --allow-empty
// RIGHT-NOT: warning
#include <piko.h>

struct State {
  int place = 3;
  piko::Buffer<int> sum;
  piko::Buffer<float> last;
  piko::Buffer<int> table;
};

struct Add : piko::Stage<0, 0, 64, int, int>, piko::Uses<State> {
  void process(const int &i) {
    // CHECK: warnings-conflicts.cpp:[[#@LINE + 2]]:20: warning: a data race: each primitive writes this element of 'sum', and which one is last is not defined
    // CHECK: note: let each write an element of its own, or use an integer atomic such as piko::atomicAdd, or an update of a pixel
    state().sum[0] += i;
    emit(i);
  }
};
struct Count : piko::Stage<0, 0, 64, int, int>, piko::Uses<State> {
  void process(const int &i) {
    // CHECK: warnings-conflicts.cpp:[[#@LINE + 1]]:{{[0-9]+}}: warning: a data race: each primitive writes this element of 'sum'
    state().sum[4] += 1;
    emit(i);
  }
};
struct Keep : piko::Stage<0, 0, 64, int, int>, piko::Uses<State> {
  void process(const int &i) {
    // CHECK: warnings-conflicts.cpp:[[#@LINE + 1]]:{{[0-9]+}}: warning: a data race: each primitive writes this element of 'last'
    state().last[state().table[state().place]] = 0.5f * float(i);
    emit(i);
  }
};
struct Iterate : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) {
    parallelFor(8, [&](int k) {
      // CHECK: warnings-conflicts.cpp:[[#@LINE + 1]]:{{[0-9]+}}: warning: a data race: each iteration writes this element of 'last'
      state().last[1] = float(k);
    });
  }
};
struct Races : piko::Pipe<State> {
  Add add;
  Count count;
  Keep keep;
  Iterate iterate;
  Races() {
    source(add);
    connect(add, 0, count);
    connect(count, 0, keep);
    connect(keep, 0, iterate);
  }
};

struct One : piko::Stage<0, 0, 64, int, int>, piko::Uses<State> {
  void process(const int &i) {
    state().sum[i] = i;
    state().sum[0] = 1; // the same from each
    if (i == 7)
      state().sum[1] = i; // one of them
    piko::atomicAdd(state().sum[2], i);
    parallelFor(4, [&](int k) { state().last[4 * i + k] = float(k); });
    emit(i);
  }
};
struct Serial : piko::Stage<0, 0, 64, int, int>, piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::Serialize); }
  void process(const int &i) {
    state().table[0] = i;
    emit(i);
  }
};
struct Whole : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const piko::List<int> &list) {
    int sum = 0;
    for (int64_t i = 0; i < list.size(); ++i)
      sum += list[i];
    state().last[0] = float(sum + int(list.size()));
  }
};
struct Right : piko::Pipe<State> {
  One one;
  Serial serial;
  Whole whole;
  Right() {
    source(one);
    connect(one, 0, serial);
    connect(serial, 0, whole);
  }
};
