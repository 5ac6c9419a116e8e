// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a constructor expects of the host's numbers is said of each leaf field.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Triangle {
  float area;
  glm::uvec3 vertex;
  int8_t kind[2][3];
};
struct Vertex {
  glm::vec3 at;
  uint16_t material;
};
struct Mesh {
  piko::Buffer<Vertex> vertices;
  piko::Buffer<int64_t> order;
  piko::Buffer<glm::ivec2> ends;
  piko::Buffer<float> shines[2];
};

struct Draw : piko::Stage<0, 0, 64, Triangle>, piko::Uses<Mesh> {
  void process(const Triangle &) {}
};

constexpr int kinds = 7;

// CHECK-LABEL: piko.pipeline @MeshPipe
// CHECK: piko.source @draw
struct MeshPipe : piko::Pipe<Mesh> {
  Draw draw;
  MeshPipe() {
    // CHECK-NEXT: piko.contract source 0 "vertex.x" unsigned indexes @vertices
    // CHECK-NEXT: piko.contract source 0 "vertex.y" unsigned indexes @vertices
    // CHECK-NEXT: piko.contract source 0 "vertex.z" unsigned indexes @vertices
    expectIndex<&Triangle::vertex>(0, state().vertices);
    // CHECK-NEXT: piko.contract source 0 "kind" below 7
    expectIndex<&Triangle::kind>(0, kinds);
    // CHECK-NEXT: piko.contract @vertices "material" unsigned indexes @"shines[1]"
    expectIndex<&Vertex::material>(state().vertices, state().shines[1]);
    // CHECK-NEXT: piko.contract @order "value" indexes @order
    expectIndex(state().order, state().order);
    // CHECK-NEXT: piko.contract @ends "x" indexes @order
    // CHECK-NEXT: piko.contract @ends "y" indexes @order
    expectIndex(state().ends, state().order);
    source(draw);
  }
};
