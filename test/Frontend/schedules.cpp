// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A directive that is the same for all bins is an attribute; what depends on
// the bin or on constants is code.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct State {
  int split = 8;
};

// CHECK: piko.constant @split : @int value [8 : i32]

// A tile split on another kind is accepted, and has no effect.
// CHECK-LABEL: piko.stage @fixed
// CHECK: piko.schedule serialize batch 16 lanes one{{$}}
// CHECK-NEXT: piko.process precision relaxed ulps 2 {
struct Fixed : piko::Stage<0, 0, 64, int, int> {
  void schedule(piko::BinId) {
    specifySchedule(piko::Serialize, 3);
    batch(16);
    specifyLanes(piko::Lanes::One);
    specifyPrecision(piko::Precision::Relaxed);
    specifyUlps(2);
  }
  void process(const piko::List<int> &list) { emit(list[0]); }
};

// CHECK-LABEL: piko.stage @dynamic
// CHECK: piko.schedule load_balance end_stage [@fixed] unordered lanes iterations dynamic {
// CHECK-NEXT: ^bb0(%[[BIN:.*]]: index):
struct Dynamic : piko::Stage<8, 8, 64, int>, piko::Uses<State> {
  void assignBin(const int &i) { assignToAll(i); }
  void schedule(piko::BinId bin) {
    specifyOrder(piko::Unordered);
    // CHECK: %[[NUMBER:.*]] = arith.index_cast %[[BIN]] : index to i64
    // CHECK: scf.if
    // CHECK-NEXT: piko.set_every_bin
    // CHECK-NEXT: else
    // CHECK: %[[LOADED:.*]] = piko.load @split "value" : i32
    // CHECK: %[[SPLIT:.*]] = arith.extsi %[[LOADED]] : i32 to i64
    // CHECK: piko.set_schedule %{{.*}} tile_split %[[SPLIT]]
    if (bin.index % 2)
      specifySchedule(piko::All, state().split);
    else
      everyBin();
    endStage<Fixed>();
    // CHECK: piko.set_batch %{{.*}}
    // CHECK: piko.return
    batch(bin.index + 1);
    specifyLanes(piko::Lanes::Iterations);
  }
  void process(const piko::List<int> &) {}
};

// A precision says nothing of where and when the stage runs: there is no
// schedule. Strict is what holds without it.
// CHECK-LABEL: piko.stage @contracted
// CHECK-NOT: piko.schedule
// CHECK: piko.process precision contracted {
struct Contracted : piko::Stage<0, 0, 64, int> {
  void schedule(piko::BinId) { specifyPrecision(piko::Precision::Contracted); }
  void process(const int &) {}
};
// CHECK-LABEL: piko.stage @strict
// CHECK-NOT: piko.schedule
// CHECK: piko.process {
struct Strict : piko::Stage<0, 0, 64, int> {
  void schedule(piko::BinId) { specifyPrecision(piko::Precision::Strict); }
  void process(const int &) {}
};
struct Pipeline : piko::Pipe<State> {
  Fixed fixed;
  Dynamic dynamic;
  Contracted contracted;
  Strict strict;
  Pipeline() {
    source(contracted);
    source(strict);
    source(fixed);
    connect(fixed, 0, dynamic);
  }
};
