// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A reference that is chosen in a loop keeps what it was chosen with.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Item {
  float x;
};
struct State {
  piko::Buffer<Item> items;
};

// One kind of thing: the index is enough.
// CHECK-LABEL: piko.stage @elements
struct Elements : piko::Stage<0, 0, 64, Item, Item>, piko::Uses<State> {
  void process(const Item &) {
    const Item *best = &state().items[0];
    // CHECK: scf.while (%{{.*}} = %c0_i64, %{{.*}} = %c1_i32) : (i64, i32)
    // CHECK: piko.load @items[%{{.*}}] "x"
    // CHECK: piko.load @items[%{{.*}} : i64] "x"
    // CHECK: arith.select %{{.*}} : i64
    for (int i = 1; i < state().items.size(); ++i)
      if (state().items[i].x > best->x)
        best = &state().items[i];
    // CHECK: piko.load @items[%{{.*}} : i64] "x"
    emit(*best);
  }
};

// Nothing, at first.
// CHECK-LABEL: piko.stage @nothing
struct Nothing : piko::Stage<0, 0, 64, Item, Item> {
  void process(const piko::List<Item> &list) {
    const Item *last = nullptr;
    // CHECK: scf.while
    for (const Item &item : list)
      if (item.x > 0)
        last = &item;
    // CHECK: scf.if
    // CHECK: %[[LAST:.*]] = piko.list_at
    // CHECK: piko.get %[[LAST]] "x"
    if (last)
      emit(*last);
  }
};
struct Drain : piko::Stage<0, 0, 64, Item> {
  void process(const Item &) {}
};
struct Pipeline : piko::Pipe<State> {
  Elements elements;
  Nothing nothing;
  Drain drain;
  Pipeline() {
    source(elements);
    connect(elements, 0, nothing);
    connect(nothing, 0, drain);
  }
};
