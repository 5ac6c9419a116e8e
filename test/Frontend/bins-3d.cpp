// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bins of three dimensions, images of three, boxes, and queries.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Splat {
  glm::vec3 centre;
  float radius;
};
struct State {
  piko::Image<float, 3> density;
  piko::Buffer<int64_t> counts;
};

// CHECK-LABEL: piko.pipeline @Pipeline rank 3
// CHECK: piko.image @density : @float rank 3
// CHECK: piko.stage @splat bins [4, 4, 8] threads 128
struct SplatStage : piko::BasicStage<piko::Bins<4, 4, 8>, 128, Splat>,
                    piko::Uses<State> {
  // CHECK: piko.assign_box[%{{.*}}, %{{.*}}, %{{.*}} : {{.*}}] to[%{{.*}}, %{{.*}}, %{{.*}} : {{.*}}]
  void assignBin(const Splat &s) {
    assignToBoundingBox(s, s.centre - s.radius, s.centre + s.radius);
  }
  // CHECK: piko.process
  // CHECK: piko.bin_lo %{{.*}}[2]
  // CHECK: piko.update @density[%{{.*}}, %{{.*}}, %{{.*}} : i32, i32, i32]
  // CHECK: piko.atomic add @counts[%{{.*}} : i64] "value", %{{.*}} : i64
  void process(const Splat &s) {
    update(state().density, binLo(), [&](float &d) { d += s.radius; });
    piko::atomicAdd(state().counts[bin().index], 1);
  }
};
struct Pipeline : piko::Pipe<State> {
  SplatStage splat;
  Pipeline() { source(splat); }
};
