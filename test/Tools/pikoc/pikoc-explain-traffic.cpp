// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What kernels' text reads and writes of a GPU's memory.
//
// RUN: pikoc %s --explain --target cuda --gpu-chip sm_80 -o %t.txt
// RUN: FileCheck %s --input-file %t.txt
//
// CHECK-LABEL: Global memory, as kernels' text reads and writes it

#include <piko.h>

struct Point {
  float x, y, weight;
  int32_t index;
};
struct Mark {
  int32_t pixel;
  float weight;
};

struct State {
  float scale;
  piko::Buffer<float> table;
  piko::Buffer<uint32_t> counts;
  piko::Image<float> image;
};

// A field that is read twice counts once, and so does what is always read if it is
// under a condition, too. What is read of a constant does not count. Under a
// condition is what may not happen.
//
// CHECK-NEXT: kernel_place
// CHECK-NEXT: {{^}}    each primitive of place: reads 12 to 20 B, changes atomically 0 to 4 B
// CHECK-NEXT: {{^}}      each iteration of a loop: reads 4 B
// CHECK-NEXT: each primitive emitted to draw: writes 32 B, of which 8 are the record
// CHECK-NEXT: each bin of draw that a primitive is put into: writes 32 B
struct Place : piko::Stage<0, 0, 64, Point, Mark>, piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::LoadBalance); }
  void process(const Point &p) {
    float sum = p.x * state().scale;
    for (int32_t i = 0; i < p.index; ++i)
      sum += state().table[i];
    if (p.x > p.y) {
      sum += p.weight * p.x + state().table[p.index];
      piko::atomicAdd(state().counts[p.index & 7], 1u);
    }
    emit(Mark{p.index & 63, sum});
  }
};

// The pixel is changed by who reads it; a list's elements belong to its loop.
//
// CHECK-NEXT: kernel_draw
// CHECK-NEXT: {{^}}    each iteration of a loop: reads 12 B, writes 4 B
// CHECK-NOT: each
struct Draw : piko::Stage<64, 1, 64, Mark>, piko::Uses<State> {
  void assignBin(const Mark &m) {
    assignToBin(m, binFromPosition(glm::ivec2(m.pixel, 0)));
  }
  void process(const piko::List<Mark> &marks) {
    for (const Mark &m : marks)
      update(state().image, glm::ivec2(m.pixel, 0),
             [&](float &value) { value += m.weight; });
  }
};

struct Whole : piko::Pipe<State> {
  Place place;
  Draw draw;
  Whole() {
    source(place);
    connect(place, 0, draw);
  }
};
