// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is declared in an iteration belongs to it, what is declared outside is
// shared by all of them and stays in memory.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Line {
  int count;
  float z;
};
struct State {
  piko::Image<float> image;
};

// CHECK-LABEL: piko.stage @arrays
// CHECK: %[[SHARED:.*]] = memref.alloca() : memref<64xf32>
// CHECK: %[[COUNT:.*]] = piko.get %{{.*}} "count"
// CHECK: %[[N:.*]] = arith.index_cast %[[COUNT]] : i32 to index
struct Arrays : piko::Stage<0, 0, 64, Line, Line> {
  void process(const Line &line) {
    float shared[64];
    // CHECK: piko.parallel_for %[[N]] {
    // CHECK-NEXT: ^bb0(%[[I:.*]]: index):
    parallelFor(line.count, [&](int i) {
      // CHECK-NEXT: %[[OWN:.*]] = memref.alloca() : memref<4xf32>
      float own[4];
      // CHECK: arith.select
      float unset;
      if (i % 2)
        unset = 3;
      else
        unset = 4;
      // CHECK: memref.store %{{.*}}, %[[OWN]]
      for (int k = 0; k < 4; ++k)
        own[k] = line.z + unset;
      // CHECK: %[[VALUE:.*]] = memref.load %[[OWN]]
      // CHECK: memref.store %[[VALUE]], %[[SHARED]]
      shared[i] = own[i % 4];
      // What another iteration wrote is not known before the barrier.
      // CHECK: piko.sync
      sync();
      // CHECK: %[[READ:.*]] = memref.load %[[SHARED]]
      // CHECK: piko.emit 0(%{{.*}}, %[[READ]])
      if (i > 2)
        return;
      emit(Line{i, shared[i]});
      // CHECK: piko.yield
    });
  }
};

// One element that is written by one iteration is shared, too.
// CHECK-LABEL: piko.stage @last
struct Last : piko::Stage<0, 0, 64, Line, Line> {
  void process(const Line &line) {
    // CHECK: %[[FOUND:.*]] = memref.alloca() : memref<1xf32>
    float found[1];
    // CHECK: piko.parallel_for
    parallelFor(line.count, [&](int i) {
      // CHECK: scf.if
      // CHECK: memref.store %{{.*}}, %[[FOUND]]
      if (i == line.count - 1)
        found[0] = float(i);
    });
    // CHECK: piko.yield
    // CHECK: memref.load %[[FOUND]]
    emit(Line{0, found[0]});
  }
};

// CHECK-LABEL: piko.stage @nested
struct Nested : piko::Stage<8, 8, 64, Line>, piko::Uses<State> {
  void assignBin(const Line &line) { assignToAll(line); }
  void process(const Line &line) {
    // CHECK: piko.parallel_pixels(%{{.*}}, %{{.*}}) to(%{{.*}}, %{{.*}}) {
    parallelForPixels([&](glm::ivec2 p) {
      // CHECK: %[[PART:.*]] = memref.alloca() : memref<3xf32>
      float part[3];
      // CHECK: piko.parallel_for %{{.*}} {
      // CHECK: memref.store %{{.*}}, %[[PART]]
      // CHECK: piko.yield
      parallelFor(3, [&](int i) { part[i] = line.z * i; });
      // CHECK: piko.store %{{.*}}, @image[
      // CHECK: piko.yield
      state().image.store(p, part[p.x % 3]);
    });
  }
};
struct Pipeline : piko::Pipe<State> {
  Arrays arrays;
  Last last;
  Nested nested;
  Pipeline() {
    source(arrays);
    connect(arrays, 0, last);
    connect(last, 0, nested);
  }
};
