// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A reference to one of several things, pointers that walk through an array,
// and a table of constants.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

#include <algorithm>

struct Item {
  float value;
  int index;
};
struct State {
  float weights[6];
  piko::Buffer<Item> items;
};
static const int table[3] = {5, 7, 11};

// CHECK-LABEL: piko.stage @choose
struct Choose : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &item) {
    // CHECK-DAG: piko.load @items[%{{.*}} : i32] "value"
    // CHECK-DAG: piko.get %{{.*}} "value"
    const Item &nearer = item.index > 3 ? state().items[item.index] : item;
    // CHECK: scf.while
    // CHECK: piko.load @weights "value"[%{{.*}}]
    float sum = std::max(nearer.value, 0.5f);
    for (float weight : state().weights)
      sum += weight * nearer.value;
    // CHECK: memref.load %{{.*}} : memref<3xi32>
    state().items[table[item.index]].value = sum;
  }
};
struct Pipeline : piko::Pipe<State> {
  Choose choose;
  Pipeline() { source(choose); }
};
