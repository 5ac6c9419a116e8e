// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What pikoc says about waits, lists, cycles and schedules with code.
// RUN: pikoc %s --explain | FileCheck %s
// RUN: pikoc %s --explain --without eliminate-schedules,fuse-kernels | FileCheck %s --check-prefix=WITHOUT

// WITHOUT: waits until nothing can reach the bin: a kernel break, because piko-fuse-kernels did not run
// WITHOUT: Schedule repeat: any core takes the next bins

#include <piko.h>

struct Item {
  glm::ivec2 at;
  int value;
  int unread;
};
struct State {
  int limit;
  piko::Buffer<int> sums;
};

// CHECK: Pipeline All
// CHECK: Stages, in order:

// CHECK-NEXT: {{^  }}first: bins of 4 x all, 64 threads, serialize, contracted precision
// CHECK-NEXT: from source 0: 16 bytes a primitive
struct First : piko::Stage<4, 0, 64, Item, Item, Item>, piko::Uses<State> {
  void assignBin(const Item &i) { assignToBoundingBox(i, i.at, i.at + 3); }
  void schedule(piko::BinId) {
    specifySchedule(piko::Serialize);
    specifyPrecision(piko::Precision::Contracted);
  }
  void process(const Item &i) {
    piko::atomicAdd(state().sums[0], i.value);
    emit(i, 0);
    emit(i, 1);
  }
};

// CHECK-NEXT: {{^  }}repeat: one bin, 64 threads, no schedule, on a cycle
// CHECK-NEXT: from first port 0: 12 bytes a primitive, 16 before it was pruned
// CHECK-NEXT: from repeat port 1: 12 bytes a primitive, 16 before it was pruned
struct Repeat : piko::Stage<0, 0, 64, Item, Item, Item>, piko::Uses<State> {
  void process(const Item &i) {
    Item next = i;
    next.value -= 1;
    emit(next, 0);
    if (next.value > 0)
      emit(next, 1);
  }
};

// CHECK-NEXT: {{^  }}gather: bins of 8 x 8, 64 threads, load_balance
// CHECK-NEXT: from repeat port 0: 12 bytes a primitive, 16 before it was pruned
// CHECK-NEXT: takes lists of 16 primitives, of empty bins too: a kernel break, for the reason that piko-fuse-kernels gives below
struct Gather : piko::Stage<8, 8, 64, Item, Item>, piko::Uses<State> {
  void assignBin(const Item &i) { assignToBin(i, binFromPosition(i.at)); }
  void schedule(piko::BinId) {
    batch(16);
    everyBin();
  }
  void process(const piko::List<Item> &items) {
    for (const Item &i : items)
      emit(i);
  }
};

// CHECK-NEXT: {{^  }}late: bins of 8 x 8, 64 threads, a schedule for each bin
// CHECK-NEXT: from gather port 0: 4 bytes a primitive, 16 before it was pruned
// CHECK-NEXT: waits until nothing can reach the bin: a kernel break, for the reason that piko-fuse-kernels gives below
struct Late : piko::Stage<8, 8, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &i) { assignToPreviousBins(i); }
  void schedule(piko::BinId bin) {
    endBin();
    if (bin.index < state().limit)
      specifySchedule(piko::DirectMap);
  }
  void process(const Item &i) { piko::atomicAdd(state().sums[1], i.value); }
};

// CHECK-NEXT: {{^  }}unseen: one bin, 64 threads, no schedule
// CHECK-NEXT: was removed
struct Unseen : piko::Stage<0, 0, 64, Item> {
  void process(const Item &) {}
};

// CHECK-NEXT: {{^  }}last: one bin, 64 threads, all in tiles of 64 primitives, unordered
// CHECK-NEXT: from source 1: 16 bytes a primitive
// CHECK-NEXT: waits for the end of stage first: a kernel break after kernel_first
struct Last : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void schedule(piko::BinId) {
    specifySchedule(piko::All, 64);
    specifyOrder(piko::Unordered);
    endStage<First>();
  }
  void process(const Item &i) { piko::atomicAdd(state().sums[2], i.value); }
};

struct All : piko::Pipe<State> {
  First first;
  Unseen unseen;
  Repeat repeat;
  Gather gather;
  Late late;
  Last last;
  All() {
    source(first);
    source(last);
    connect(first, 0, repeat);
    connect(first, 1, unseen);
    connect(repeat, 0, gather);
    connect(repeat, 1, repeat);
    connect(gather, 0, late);
  }
};

// CHECK: Kernels, in order:
// CHECK-NEXT: {{^  }}before all others
// CHECK-NEXT: Schedule late, for each bin
// CHECK-NEXT: {{^  }}source_0_first
// CHECK-NEXT: AssignBin first for source 0
// CHECK-NEXT: Schedule first: serialize, pre-scheduled, because the core follows from the bin
// CHECK-NEXT: {{^  }}kernel_first
// CHECK-NEXT: Process first
// CHECK-NEXT: AssignBin repeat: there is one bin
// CHECK-NEXT: {{^  }}kernel_repeat, again until its cycle is empty
// CHECK-NEXT: Schedule repeat: eliminated, because any core takes the next bins
// CHECK-NEXT: Process repeat
// CHECK-NEXT: AssignBin gather{{$}}
// CHECK-NEXT: AssignBin repeat: there is one bin
// CHECK-NEXT: {{^  }}kernel_gather
// CHECK-NEXT: Schedule gather: eliminated
// CHECK-NEXT: Process gather
// CHECK-NEXT: AssignBin late
// CHECK-NEXT: {{^  }}kernel_late
// CHECK-NEXT: Process late
// CHECK-NEXT: {{^  }}kernel_last
// CHECK-NEXT: AssignBin last for source 1: there is one bin
// CHECK-NEXT: Schedule last: all in tiles of 64 primitives, pre-scheduled, because all cores take part
// CHECK-NEXT: Process last

// A note at another place has its own.
// CHECK: What the passes did or refused:
// CHECK-NEXT: piko-apply-precision
// CHECK-NEXT: pikoc-explain.cpp:{{[0-9:]+}} stage 'first' is contracted: 0 additions
// CHECK: {{^  }}piko-fuse-stages
// CHECK: {{^    .*}}pikoc-explain.cpp:[[#GATHER:]]:10: stage 'gather' is not fused with stage 'repeat'
// CHECK-NEXT: {{^      .*}}pikoc-explain.cpp:[[#GATHER-1]]:10: stage 'repeat' is on a cycle
// CHECK: {{^  }}piko-prune
// CHECK: stage 'unseen' is removed
