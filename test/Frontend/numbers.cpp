// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What C++ leaves open is pinned down: conversions saturate and NaN gives 0,
// fmin gives the other number for a NaN, and the C library's functions are
// piko's.
// RUN: piko-translate --cpp-to-piko %s 2>%t.err | FileCheck %s
// RUN: FileCheck %s --check-prefix=WARNING --input-file=%t.err
#include <piko.h>

#include <cmath>

struct Item {
  float a, b;
};
struct State {
  piko::Buffer<int> integers;
  piko::Buffer<float> floats;
};

// CHECK-LABEL: piko.stage @convert
// CHECK: %[[A:.*]] = piko.get %{{.*}} "a"
// CHECK-DAG: %[[I:.*]] = arith.fptosi %[[A]] : f32 to i32
// CHECK-DAG: %[[HIGH:.*]] = arith.cmpf oge, %[[A]], %{{.*}} : f32
// CHECK-DAG: %[[LOW:.*]] = arith.cmpf olt, %[[A]], %{{.*}} : f32
// CHECK-DAG: %[[NAN:.*]] = arith.cmpf uno, %[[A]], %{{.*}} : f32
// CHECK: %[[S0:.*]] = arith.select %[[HIGH]], %{{.*}}, %[[I]] : i32
// CHECK: %[[S1:.*]] = arith.select %[[LOW]], %{{.*}}, %[[S0]] : i32
// CHECK: arith.select %[[NAN]], %{{.*}}, %[[S1]] : i32
struct Convert : piko::Stage<0, 0, 64, Item, Item>, piko::Uses<State> {
  void process(const Item &item) {
    state().integers[0] = int(item.a);
    emit(item, 0);
  }
};

// CHECK-LABEL: piko.stage @minimum
// CHECK: %[[LESS:.*]] = arith.cmpf olt, %[[B:.*]], %[[A:.*]] : f32
// CHECK: %[[NAN:.*]] = arith.cmpf uno, %[[A]], %{{.*}} : f32
// CHECK: %[[TAKES:.*]] = arith.ori %[[LESS]], %[[NAN]] : i1
// CHECK: arith.select %[[TAKES]], %[[B]], %[[A]] : f32
struct Minimum : piko::Stage<0, 0, 64, Item, Item>, piko::Uses<State> {
  void process(const Item &item) {
    state().floats[0] = std::fmin(item.a, item.b);
    emit(item, 0);
  }
};

// CHECK-LABEL: piko.stage @sine
// CHECK-NOT: math.sin
struct Sine : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  void process(const Item &item) {
    // WARNING: numbers.cpp:[[#@LINE + 1]]:25: warning: 'sin' is compiled as piko::sin: a plain C++ build of this file may differ, unless you write that
    state().floats[0] = std::sin(item.a);
  }
};
struct Pipeline : piko::Pipe<State> {
  Convert convert;
  Minimum minimum;
  Sine sine;
  Pipeline() {
    source(convert);
    connect(convert, 0, minimum);
    connect(minimum, 0, sine);
  }
};
