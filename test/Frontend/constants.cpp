// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Constants keep what they are initialized with; the state may have bases, and
// stages may use one of them.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Light {
  glm::vec3 color = {1, 0.5f, 0};
  int kind;
};
struct First {
  float threshold = 0.5f;
};
struct Second {
  int limit = 0;
  piko::Buffer<int> counts;
};
struct State : First, Second {
  double unset;
  int weights[3] = {1, 2};
  Light light;
};

// CHECK: piko.constant @threshold : @float value [5.000000e-01 : f32]
// CHECK: piko.constant @limit : @int value [0 : i32]
// CHECK: piko.buffer @counts : @int
// CHECK: piko.constant @unset : @double{{$}}
// CHECK: piko.constant @weights : @"int[3]" value [1 : i32, 2 : i32, 0 : i32]
// CHECK: piko.constant @light : @Light value [1.000000e+00 : f32, 5.000000e-01 : f32, 0.000000e+00 : f32, 0 : i32]

// CHECK-LABEL: piko.stage @stage
struct Stage : piko::Stage<0, 0, 64, int>, piko::Uses<Second> {
  void process(const int &i) {
    // CHECK: %[[LIMIT:.*]] = piko.load @limit "value" : i32
    // CHECK: piko.atomic add @counts[%{{.*}}] "value", %[[LIMIT]] : i32
    piko::atomicAdd(state().counts[i], state().limit);
  }
};
struct Pipeline : piko::Pipe<State> {
  Stage stage;
  Pipeline() { source(stage); }
};
