// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A call that reads a pixel after its own update sees what the update wrote.
// RUN: %compare_targets %s --count 2000 | FileCheck %s
// CHECK: equal
#include "../Inputs/ports.h"

struct Pixel {
  float a = 2;
  int count = 0;
};
struct State {
  piko::Image<Pixel> image;
};

struct Twice : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    glm::ivec2 at(p.x, p.y % domain().y);
    float before = state().image(at).a;
    update(state().image, at, [&](Pixel &pixel) {
      pixel.a = pixel.a * 0.5f + p.value;
      ++pixel.count;
    });
    float after = state().image(at).a;
    update(state().image, at,
           [&](Pixel &pixel) { pixel.a += before * after * 0.125f; });
  }
};
struct Reads : piko::Pipe<State> {
  Twice twice;
  Reads() { source(twice); }
};
