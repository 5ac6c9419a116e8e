// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a constructor cannot expect of the host's numbers.
// RUN: not piko-translate --cpp-to-piko --pipe=NoSource %s 2>&1 | FileCheck %s --check-prefix=SOURCE
// RUN: not piko-translate --cpp-to-piko --pipe=OtherRecord %s 2>&1 | FileCheck %s --check-prefix=RECORD
// RUN: not piko-translate --cpp-to-piko --pipe=Nothing %s 2>&1 | FileCheck %s --check-prefix=NOTHING
// RUN: not piko-translate --cpp-to-piko --pipe=Varying %s 2>&1 | FileCheck %s --check-prefix=VARYING
// RUN: not piko-translate --cpp-to-piko --pipe=Allocated %s 2>&1 | FileCheck %s --check-prefix=ALLOCATED
// RUN: not piko-translate --cpp-to-piko --pipe=Written %s 2>&1 | FileCheck %s --check-prefix=WRITTEN
// RUN: not piko-translate --cpp-to-piko --pipe=Float -DFLOAT %s 2>&1 | FileCheck %s --check-prefix=FLOAT
#include <piko.h>

struct Item {
  int index;
  float weight;
};
struct Other {
  int index;
};
struct State {
  int limit = 5;
  piko::Buffer<Item> items;
  piko::Buffer<int> order;
};
struct Take : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &i) { state().items[0] = i; }
};

struct NoSource : piko::Pipe<State> {
  Take take;
  NoSource() {
    source(take);
    // SOURCE: errors-contracts.cpp:[[#@LINE + 1]]:5: error: expected one of the 1 sources of pipeline 'NoSource', but got source 1
    expectIndex<&Item::index>(1, state().order);
  }
};

struct OtherRecord : piko::Pipe<State> {
  Take take;
  OtherRecord() {
    source(take);
    // RECORD: errors-contracts.cpp:[[#@LINE + 1]]:5: error: expected a field of 'Item', which source 0 has, but got one of 'Other'
    expectIndex<&Other::index>(0, state().order);
  }
};

struct Nothing : piko::Pipe<State> {
  Take take;
  Nothing() {
    source(take);
    // NOTHING: errors-contracts.cpp:[[#@LINE + 1]]:5: error: expected an index to be below a number of at least 1, but got 0
    expectIndex<&Item::index>(0, 0);
  }
};

struct Varying : piko::Pipe<State> {
  Take take;
  Varying() {
    source(take);
    // VARYING: errors-contracts.cpp:[[#@LINE + 1]]:5: error: expected what an index is below to be a constant
    expectIndex<&Item::index>(0, state().limit);
  }
};

struct Allocated : piko::Pipe<State> {
  Take take;
  Allocated() {
    source(take);
    // ALLOCATED: errors-contracts.cpp:[[#@LINE + 1]]:5: error: expected indices that the host binds, but 'order' is allocated for a source
    expectIndex(state().order, state().items);
    allocateForSource(state().order, 0);
  }
};

struct Written : piko::Pipe<State> {
  Take take;
  Written() {
    source(take);
    // WRITTEN: errors-contracts.cpp:[[#@LINE - 53]]:50: error: expected no stage to write 'items', whose indices are tested where the host binds them
    // WRITTEN: errors-contracts.cpp:[[#@LINE + 1]]:5: note: expectIndex is here: leave it out, or write to another buffer
    expectIndex<&Item::index>(state().items, state().order);
  }
};

#ifdef FLOAT
struct Float : piko::Pipe<State> {
  Take take;
  Float() {
    source(take);
    // FLOAT: error: {{.*}}expected a field of integers: one, or an array or a GLM vector of them
    expectIndex<&Item::weight>(0, state().order);
  }
};
#endif
