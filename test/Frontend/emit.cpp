// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records, state, edges, and the three phases of two stages.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Sample {
  float weight;
  glm::ivec2 at;
};
struct Cell {
  float sum = 2;
};
struct State {
  float scale;
  piko::Buffer<Sample> table;
  piko::Image<Cell> image;
};

// CHECK-DAG: piko.record @Sample {"weight" : f32 at 0, "at.x" : i32 at 4, "at.y" : i32 at 8} size 12 align 4
// CHECK-DAG: piko.record @Cell {"sum" : f32 at 0} size 4 align 4
// CHECK-DAG: piko.record @float {"value" : f32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @Pipeline rank 2
// CHECK-NEXT: piko.constant @scale : @float
// CHECK-NEXT: piko.buffer @table : @Sample per_source 0
// CHECK-NEXT: piko.image @image : @Cell rank 2 clear [2.000000e+00 : f32]
// CHECK-NEXT: piko.source @scaleStage
// CHECK-NEXT: piko.edge @scaleStage[0] -> @store

// CHECK-LABEL: piko.stage @scaleStage bins [0, 0] threads 64 : @Sample -> [@Sample]
struct Scale : piko::Stage<0, 0, 64, Sample, Sample>, piko::Uses<State> {
  // A copy of the primitive is its fields, one by one.
  // CHECK: %[[W:.*]] = piko.get %{{.*}} "weight"
  // CHECK: %[[S:.*]] = piko.load @scale "value" : f32
  // CHECK: %[[P:.*]] = arith.mulf %[[W]], %[[S]]
  // CHECK: piko.emit 0(%[[P]], %{{.*}}, %{{.*}}) : f32, i32, i32
  void process(const Sample &s) {
    Sample copy = s;
    copy.weight *= state().scale;
    emit(copy);
  }
};

// CHECK-LABEL: piko.stage @store bins [8, 16] threads 32 : @Sample -> []
struct Store : piko::Stage<8, 16, 32, Sample>, piko::Uses<State> {
  // CHECK: piko.assign
  // CHECK: %[[BIN:.*]] = piko.bin_at %{{.*}}, %{{.*}} : i32, i32
  // CHECK: piko.assign_to %[[BIN]]
  void assignBin(const Sample &s) { assignToBin(s, binFromPosition(s.at)); }
  // CHECK: piko.schedule all tile_split 4
  void schedule(piko::BinId) { specifySchedule(piko::All, 4); }
  // CHECK: piko.process
  // CHECK: piko.update @image
  // CHECK-NEXT: ^bb0(%[[OLD:.*]]: f32):
  // CHECK: %[[NEW:.*]] = arith.addf %[[OLD]], %{{.*}} : f32
  // CHECK: piko.yield[%[[NEW]] : f32]
  void process(const Sample &s) {
    update(state().image, s.at, [&](Cell &c) { c.sum += s.weight; });
  }
};

struct Pipeline : piko::Pipe<State> {
  Scale scaleStage;
  Store store;
  Pipeline() {
    source(scaleStage);
    connect(scaleStage, 0, store);
    allocateForSource(state().table, 0);
  }
};
