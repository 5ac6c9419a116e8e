// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The function of a reduction or a scan becomes the region of the operation,
// with the numbers of a record one by one.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Item {
  int count;
  unsigned id;
  float depth;
};
struct Best {
  float depth;
  int index;
};

// CHECK-LABEL: piko.stage @inside
struct Inside : piko::Stage<0, 0, 64, Item, Item> {
  void process(const Item &item) {
    // CHECK: piko.parallel_for
    parallelFor(item.count, [&](int i) {
      Item out = item;
      // CHECK: %[[SUM:.*]] = piko.reduce %{{.*}} : f32 {
      // CHECK-NEXT: ^bb0(%[[A:.*]]: f32, %[[B:.*]]: f32):
      // CHECK-NEXT: %[[C:.*]] = arith.addf %[[A]], %[[B]] : f32
      // CHECK-NEXT: piko.yield results[%[[C]] : f32]
      out.depth =
          reduce(item.depth * i, [](float a, float b) { return a + b; });
      // CHECK: %[[PLACE:.*]] = piko.scan %{{.*}} empty %{{.*}} : i32 {
      // CHECK-NEXT: ^bb0(%[[D:.*]]: i32, %[[E:.*]]: i32):
      // CHECK-NEXT: %[[F:.*]] = arith.addi %[[D]], %[[E]] : i32
      // CHECK-NEXT: piko.yield results[%[[F]] : i32]
      out.count = scan(i, [](int a, int b) { return a + b; }, 5);
      // CHECK: %[[ORDER:.*]] = piko.sort unsigned %{{.*}} : i32
      out.id = unsigned(sort(item.id + unsigned(i)));
      // CHECK: piko.sort %{{.*}} : i32
      out.id += unsigned(sort(i - 3));
      // The name is for messages.
      // CHECK: %[[COUNT:.*]] = piko.reduce %{{.*}} : i64 attributes {piko.cpp_name = "any"} {
      // CHECK: arith.addi
      // CHECK: arith.cmpi {{eq|ne}}, %[[COUNT]]
      if (any(out.depth > 4))
        emit(out);
    });
  }
};

// A record with control flow; what the function captures is computed before.
// CHECK-LABEL: piko.stage @record
struct Record : piko::Stage<0, 0, 64, Item, Item> {
  void process(const Item &item) {
    parallelFor(item.count, [&](int i) {
      // CHECK: %[[LIMIT:.*]] = piko.get %{{.*}} "depth"
      // CHECK: %[[BEST:.*]]:2 = piko.reduce %{{.*}}, %{{.*}} : f32, i32 {
      // CHECK-NEXT: ^bb0(%[[A:.*]]: f32, %[[I:.*]]: i32, %[[B:.*]]: f32, %[[J:.*]]: i32):
      // CHECK-NOT: piko.get
      // CHECK: arith.cmpf
      // CHECK: piko.yield results[%{{.*}}, %{{.*}} : f32, i32]
      Best best = reduce(Best{item.depth * i, i}, [&](Best a, Best b) {
        if (b.depth < item.depth && a.depth < b.depth)
          return b;
        return a;
      });
      // CHECK: piko.emit 0(%[[BEST]]#1, %{{.*}}, %[[BEST]]#0)
      emit(Item{best.index, 0, best.depth});
    });
  }
};

// Outside of a parallelFor the result comes out through a shared element.
// CHECK-LABEL: piko.stage @outside
struct Outside : piko::Stage<0, 0, 64, Item> {
  void process(const piko::List<Item> &items) {
    // CHECK: %[[SHARED:.*]] = memref.alloca() : memref<1xi32>
    // CHECK: memref.store %{{.*}}, %[[SHARED]]
    // CHECK: piko.parallel_for
    // CHECK: %[[MAX:.*]] = piko.reduce %{{.*}} : i32
    // CHECK: scf.if
    // CHECK-NEXT: memref.store %[[MAX]], %[[SHARED]]
    int most = reduce<int>(
        items.size(), [&](int i) { return items[i].count; },
        [](int a, int b) { return piko::max(a, b); }, 0);
    // CHECK: memref.load %[[SHARED]]
    // CHECK: scf.if
    // CHECK: piko.parallel_for
    if (most > 3)
      parallelFor(most, [&](int) { sync(); });
  }
};
struct Pipeline : piko::Pipe<> {
  Inside inside;
  Record record;
  Outside outside;
  Pipeline() {
    source(inside);
    connect(inside, 0, record);
    connect(record, 0, outside);
  }
};
