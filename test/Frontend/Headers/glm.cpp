// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// GLM is plain arithmetic in the end, also where it passes functions by pointer
// (clamp of a vector) and indexes by a switch (v[i]).
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Vertex {
  glm::vec4 position;
  glm::vec3 normal;
  int axis;
};
struct State {
  glm::mat4 matrix;
  piko::Buffer<glm::vec4> results;
};

// CHECK: piko.record @"glm::mat<4, 4, float>" {"value.x" : f32[4 : 16] at 0, "value.y" : f32[4 : 16] at 4,
// CHECK-LABEL: piko.stage @transform
// CHECK-COUNT-16: arith.mulf
// CHECK: math.sqrt
// CHECK-NOT: func.call
struct Transform : piko::Stage<0, 0, 64, Vertex>, piko::Uses<State> {
  void process(const Vertex &v) {
    glm::vec4 p = state().matrix * v.position;
    glm::vec3 n = glm::clamp(glm::normalize(v.normal), 0.0f, 0.5f);
    p[v.axis] = glm::max(0.0f, glm::dot(n, glm::vec3(p)));
    state().results[v.axis] = p;
  }
};
struct Pipeline : piko::Pipe<State> {
  Transform transform;
  Pipeline() { source(transform); }
};
