// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=WAIT
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=ORDER
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=BATCH
// RUN: not piko-translate --cpp-to-piko -DCASE=4 %s 2>&1 | FileCheck %s --check-prefix=NOLIST
// RUN: not piko-translate --cpp-to-piko -DCASE=5 %s 2>&1 | FileCheck %s --check-prefix=SPLIT
// RUN: not piko-translate --cpp-to-piko -DCASE=6 %s 2>&1 | FileCheck %s --check-prefix=EMIT
// RUN: not piko-translate --cpp-to-piko -DCASE=7 %s 2>&1 | FileCheck %s --check-prefix=READ
// RUN: not piko-translate --cpp-to-piko -DCASE=8 %s 2>&1 | FileCheck %s --check-prefix=STORE
// RUN: not piko-translate --cpp-to-piko -DCASE=9 %s 2>&1 | FileCheck %s --check-prefix=FETCH
// RUN: not piko-translate --cpp-to-piko -DCASE=10 %s 2>&1 | FileCheck %s --check-prefix=FLOAT
// RUN: not piko-translate --cpp-to-piko -DCASE=11 %s 2>&1 | FileCheck %s --check-prefix=LOCAL
// RUN: not piko-translate --cpp-to-piko -DCASE=12 %s 2>&1 | FileCheck %s --check-prefix=LANES
// RUN: not piko-translate --cpp-to-piko -DCASE=13 %s 2>&1 | FileCheck %s --check-prefix=VARIABLE
// RUN: not piko-translate --cpp-to-piko -DCASE=14 %s 2>&1 | FileCheck %s --check-prefix=RANGE
// RUN: not piko-translate --cpp-to-piko -DCASE=15 %s 2>&1 | FileCheck %s --check-prefix=PRECISION
// RUN: not piko-translate --cpp-to-piko -DCASE=16 %s 2>&1 | FileCheck %s --check-prefix=PRECISION-VARIABLE
// RUN: not piko-translate --cpp-to-piko -DCASE=17 %s 2>&1 | FileCheck %s --check-prefix=PRECISION-RANGE
// RUN: not piko-translate --cpp-to-piko -DCASE=18 %s 2>&1 | FileCheck %s --check-prefix=ULPS
#include <piko.h>

struct State {
  int constant;
  piko::Buffer<int> buffer;
  piko::Buffer<float> floats;
};
struct One : piko::Stage<8, 8, 64, int, int>, piko::Uses<State> {
  void assignBin(const int &i) { assignToAll(i); }
  void schedule(piko::BinId bin) {
#if CASE == 1
    // WAIT: errors-schedule.cpp:[[#@LINE + 2]]:7: error: expected endBin for every bin, because it may not depend on the bin
    if (bin.index)
      endBin();
#elif CASE == 2
    // ORDER: errors-schedule.cpp:[[#@LINE + 2]]:7: error: expected specifyOrder for every bin, because it may not depend on the bin
    if (state().constant)
      specifyOrder(piko::Unordered);
#elif CASE == 4
    // NOLIST: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected everyBin in a stage whose process takes a list, but that of stage 'one' does not
    everyBin();
#elif CASE == 5
    // SPLIT: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected a tile split of at least 0, but got -1
    specifySchedule(piko::All, -1);
#elif CASE == 6
    // EMIT: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected only directives in the schedule phase of stage 'one'
    emit(int(bin.index));
#elif CASE == 7
    // READ: errors-schedule.cpp:[[#@LINE + 1]]:32: error: expected a schedule to depend on the bin and on constants alone, but stage 'one' reads 'buffer'
    specifySchedule(piko::All, state().buffer[0]);
#elif CASE == 8
    // STORE: errors-schedule.cpp:[[#@LINE + 1]]:23: error: expected only directives in the schedule phase of stage 'one'
    state().buffer[0] = 1;
#elif CASE == 12
    // LANES: errors-schedule.cpp:[[#@LINE + 2]]:7: error: expected specifyLanes for every bin, because it may not depend on the bin
    if (bin.index)
      specifyLanes(piko::Lanes::One);
#elif CASE == 13
    // VARIABLE: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected what lanes are given to be a constant
    specifyLanes(static_cast<piko::Lanes>(state().constant));
#elif CASE == 14
    // RANGE: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected a value of piko::Lanes, but got 4
    specifyLanes(static_cast<piko::Lanes>(4));
#elif CASE == 15
    // PRECISION: errors-schedule.cpp:[[#@LINE + 2]]:7: error: expected specifyPrecision for every bin, because it may not depend on the bin
    if (bin.index)
      specifyPrecision(piko::Precision::Relaxed);
#elif CASE == 16
    // PRECISION-VARIABLE: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected a precision to be a constant
    specifyPrecision(static_cast<piko::Precision>(state().constant));
#elif CASE == 17
    // PRECISION-RANGE: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected a value of piko::Precision, but got 3
    specifyPrecision(static_cast<piko::Precision>(3));
#elif CASE == 18
    // ULPS: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected a specifyUlps of at least 1, but got 0
    specifyUlps(0);
#endif
  }
  void process(const int &i) {
#if CASE == 9
    // FETCH: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected an atomic that returns the old value in a stage that is Unordered, but stage 'one' is not; say specifyOrder(piko::Unordered) in its schedule, or take one that returns nothing
    piko::atomicAddFetch(state().buffer[0], i);
#elif CASE == 10
    // FLOAT: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected an atomic on a float in a stage that is Unordered, but stage 'one' is not; say specifyOrder(piko::Unordered) in its schedule, or take an integer
    piko::atomicAdd(state().floats[0], 2.0f);
#elif CASE == 11
    // LOCAL: errors-schedule.cpp:[[#@LINE + 2]]:5: error: expected an atomic that returns the old value in a stage that is Unordered, but stage 'one' is not
    int local[2] = {i, 1};
    piko::atomicAddFetch(local[i & 1], i);
#endif
    emit(i);
  }
};
struct Two : piko::Stage<8, 8, 64, int> {
  void assignBin(const int &i) { assignToAll(i); }
  void schedule(piko::BinId) {
#if CASE == 3
    // BATCH: errors-schedule.cpp:[[#@LINE + 1]]:5: error: expected a batch of at least 1, but got 0
    batch(0);
#endif
  }
  void process(const piko::List<int> &) {}
};
struct Pipeline : piko::Pipe<State> {
  One one;
  Two two;
  Pipeline() {
    source(one);
    connect(one, 0, two);
  }
};
