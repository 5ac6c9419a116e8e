// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bins run on the cores that the schedule names, also where it depends on the
// bin, and whoever hands the bins out: DirectMap gives each core neighbours, which
// others take over if it is late, Serialize takes the first core, and All shares a
// bin among them.
// CASE: --pipe Mapped --domain 28 --count 6000
// CASE: --pipe Serial --domain 28 --count 6000
// CASE: --pipe ByBin --domain 28 --count 6000
// CASE: --pipe Lists --domain 28 --count 6000
// CASE: --pipe Hops --domain 28 --count 60000
// CASE: --pipe Parts --count 6000
// REQUIRES: all
// RUN: piko-compare %s --cases %s --threads 3 --owners > %t.resolved
// RUN: FileCheck %s --input-file %t.resolved
// RUN: piko-compare %s --cases %s --threads 3 --owners --without pre-schedule,eliminate-schedules > %t.queued
// RUN: FileCheck %s --input-file %t.queued
// RUN: %compare_targets %s --cases %s --threads 1 2 5
#include <piko.h>

struct Item {
  int serial, hops;
};
struct State {
  piko::Buffer<int> counts;
};

// Seven bins; the fourth one stays empty.
inline int binOf(const Item &i) { return i.serial % 7; }

template <class Self, class Input, class... Outputs>
struct Counts : piko::BasicStage<piko::Bins<4>, 64, Item, Outputs...>,
                piko::Uses<State> {
  void assignBin(const Item &i) {
    if (binOf(i) != 3)
      this->assignToBin(i, piko::BinId{binOf(i)});
  }
  void count(const Item &i) {
    piko::atomicAdd(this->state().counts[binOf(i)], i.serial);
  }
};

struct InTurn : Counts<InTurn, Item> {
  void schedule(piko::BinId) { specifySchedule(piko::DirectMap); }
  void process(const Item &i) { count(i); }
};
// CHECK: Mapped:
// CHECK: stage, bin 0: {{[0-2]}}
// CHECK: stage, bin 1: {{[0-2]}}
// CHECK: stage, bin 2: {{[0-2]}}
// CHECK: stage, bin 4: {{[0-2]}}
// CHECK: stage, bin 5: {{[0-2]}}
// CHECK: stage, bin 6: {{[0-2]}}
// CHECK: equal
struct Mapped : piko::Pipe<State> {
  InTurn stage;
  Mapped() { source(stage); }
};

struct OnOne : Counts<OnOne, Item> {
  void schedule(piko::BinId) { specifySchedule(piko::Serialize); }
  void process(const Item &i) { count(i); }
};
// CHECK: Serial:
// CHECK-NEXT: stage, bin 0: 0{{$}}
// CHECK-NEXT: stage, bin 1: 0{{$}}
// CHECK-NEXT: stage, bin 2: 0{{$}}
// CHECK: stage, bin 6: 0{{$}}
// CHECK: equal
struct Serial : piko::Pipe<State> {
  OnOne stage;
  Serial() { source(stage); }
};

// Two on the first core, the rest on their own, the last on any.
struct Chosen : Counts<Chosen, Item> {
  void schedule(piko::BinId bin) {
    if (bin.index == 1 || bin.index == 2)
      specifySchedule(piko::Serialize);
    else if (bin.index < 6)
      specifySchedule(piko::DirectMap);
  }
  void process(const Item &i) { count(i); }
};
// CHECK: ByBin:
// CHECK-NEXT: stage, bin 0: {{[0-2]}}
// CHECK-NEXT: stage, bin 1: 0{{$}}
// CHECK-NEXT: stage, bin 2: 0{{$}}
// CHECK: stage, bin 4: {{[0-2]}}
// CHECK: stage, bin 5: {{[0-2]}}
// CHECK: stage, bin 6: {{[0-2]}}
// CHECK: equal
struct ByBin : piko::Pipe<State> {
  Chosen stage;
  ByBin() { source(stage); }
};

struct InLists : Counts<InLists, Item> {
  void schedule(piko::BinId) {
    specifySchedule(piko::DirectMap);
    batch(100);
  }
  void process(const piko::List<Item> &list) {
    for (const Item &i : list)
      count(i);
  }
};
// CHECK: Lists:
// CHECK: stage, bin 0: {{[0-2]}}
// CHECK: stage, bin 1: {{[0-2]}}
// CHECK: stage, bin 2: {{[0-2]}}
// CHECK: stage, bin 4: {{[0-2]}}
// CHECK: stage, bin 5: {{[0-2]}}
// CHECK: stage, bin 6: {{[0-2]}}
// CHECK: equal
struct Lists : piko::Pipe<State> {
  InLists stage;
  Lists() { source(stage); }
};

// On a cycle, whose units are functions.
struct Hop : Counts<Hop, Item, Item> {
  void schedule(piko::BinId) { specifySchedule(piko::DirectMap); }
  void process(const Item &i) {
    count(i);
    if (i.hops % 4 > 0)
      emit(Item{i.serial + 1, i.hops % 4 - 1}, 0);
  }
};
// CHECK: Hops:
// CHECK: hop, bin 1: {{[0-2]}}
// CHECK: hop, bin 5: {{[0-2]}}
// CHECK: equal
struct Hops : piko::Pipe<State> {
  Hop hop;
  Hops() {
    source(hop);
    connect(hop, 0, hop);
  }
};

// Each core has a part of the only bin, or whoever is free takes the next.
struct Shared : piko::Stage<0, 0, 64, Item, Item>, piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::DirectMap); }
  void process(const Item &i) { emit(i); }
};
struct All : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::All, 64); }
  void process(const Item &i) {
    int sum = 0;
    for (int k = 0; k < 20000; ++k)
      sum = sum * 31 + (i.serial ^ k);
    piko::atomicAdd(state().counts[0], sum);
  }
};
// CHECK: Parts:
// CHECK-NEXT: all, bin 0: {{[0-2] [0-2]}}
// CHECK: shared, bin 0: {{[0-2]}}
// CHECK-NEXT: equal
struct Parts : piko::Pipe<State> {
  Shared shared;
  All all;
  Parts() {
    source(shared);
    connect(shared, 0, all);
  }
};
