// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Arrays inside primitives, elements and local variables, with constant and
// dynamic indices.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Corner {
  float z;
  float weight[2][3];
};
struct Patch {
  int index;
  Corner corner[4];
};
struct State {
  piko::Buffer<Patch> patches;
};

// An array of structs is one field for each of their numbers.
// CHECK: piko.record @Patch {"index" : i32 at 0, "corner.z" : f32[4 : 28] at 4, "corner.weight" : f32[4 : 28, 2 : 12, 3 : 4] at 8} size 116 align 4

// CHECK-LABEL: piko.stage @stage
struct Stage : piko::Stage<0, 0, 64, Patch>, piko::Uses<State> {
  void process(const Patch &p) {
    Patch &out = state().patches[p.index];
    // A local array that is indexed stays one.
    // CHECK: %[[A:.*]] = memref.alloca() : memref<4xf32>

    // CHECK: %[[I:.*]] = arith.index_cast %{{.*}} : i32 to index
    // CHECK: %[[W:.*]] = piko.get %{{.*}} "corner.weight"[%c2, %c1, %[[I]]]
    // CHECK: piko.store %[[W]], @patches[%{{.*}} : i32] "corner.z"[%{{.*}}] : f32
    out.corner[p.index & 3].z = p.corner[2].weight[1][p.index];

    // CHECK: memref.store %{{.*}}, %[[A]]
    // CHECK: memref.load %[[A]]
    float local[4];
    for (int i = 0; i < p.index; ++i)
      local[i] = p.corner[i].z;
    out.corner[0].weight[0][0] = local[p.index - 1];
  }
};
struct Pipeline : piko::Pipe<State> {
  Stage stage;
  Pipeline() { source(stage); }
};
