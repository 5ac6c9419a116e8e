// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What an update assigns to captured variables, or returns, are its results.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Fragment {
  glm::ivec2 at;
  float depth;
};
struct Depth {
  float z = 1;
};
struct State {
  piko::Image<Depth> depth;
};

// CHECK-LABEL: piko.stage @test
// CHECK: %[[PASSED:.*]] = piko.update @depth[%{{.*}}, %{{.*}} : i32, i32] {
// CHECK-NEXT: ^bb0(%[[OLD:.*]]: f32):
// CHECK: %[[CLOSER:.*]] = arith.cmpf olt, %{{.*}}, %[[OLD]] : f32
// CHECK: %[[NEW:.*]] = arith.select %[[CLOSER]], %{{.*}}, %[[OLD]] : f32
// CHECK: piko.yield[%[[NEW]] : f32] results[%[[CLOSER]] : i1]
// CHECK: scf.if %[[PASSED]]
// CHECK: piko.emit 0
struct Test : piko::Stage<0, 0, 64, Fragment, Fragment>, piko::Uses<State> {
  void process(const Fragment &f) {
    bool passed = false;
    update(state().depth, f.at, [&](Depth &nearest) {
      passed = f.depth < nearest.z;
      if (passed)
        nearest.z = f.depth;
    });
    if (passed)
      emit(f, 0);
  }
};

// CHECK-LABEL: piko.stage @count
// CHECK: %[[OLD_Z:.*]] = piko.update @depth
// CHECK-NEXT: ^bb0(%[[Z:.*]]: f32):
// CHECK: results[%[[Z]] : f32]
// CHECK: arith.cmpf ogt, %[[OLD_Z]]
struct Count : piko::Stage<0, 0, 64, Fragment>, piko::Uses<State> {
  void process(const Fragment &f) {
    float before = update(state().depth, f.at, [&](Depth &nearest) {
      float old = nearest.z;
      nearest.z = old + 1;
      return old;
    });
    if (before > 4)
      state().depth.store(f.at, Depth{0});
  }
};
struct Pipeline : piko::Pipe<State> {
  Test test;
  Count count;
  Pipeline() {
    source(test);
    connect(test, 0, count);
  }
};
