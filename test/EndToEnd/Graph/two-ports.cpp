// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A stage with two ports of different types.
// RUN: %compare_targets %s --count 5000 | FileCheck %s
// CHECK: equal
#include "../Inputs/ports.h"

struct Pixel {
  float sum = 0;
  int last = -1;
};
struct Count {
  int amount;
};
struct State {
  piko::Image<Pixel> image;
  piko::Buffer<int> counts;
};

struct Split : piko::Stage<0, 0, 64, Point, Point, Count> {
  void process(const Point &p) {
    if (p.tag % 3 == 0)
      emit(Count{p.tag}, 1);
    for (int i = 0; i < p.tag % 4; ++i) {
      Point q = p;
      q.x = (p.x + i) % domain().x;
      q.value = p.value * float(i + 1);
      emit(q, 0);
    }
  }
};
struct Draw : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Point &p) {
    update(state().image, glm::ivec2(p.x, p.y), [&](Pixel &pixel) {
      pixel.sum = pixel.sum * 0.5f + p.value;
      pixel.last = p.tag;
    });
  }
};
struct Add : piko::Stage<0, 0, 64, Count>, piko::Uses<State> {
  void process(const Count &c) { piko::atomicAdd(state().counts[c.amount], 1); }
};
struct TwoPorts : piko::Pipe<State> {
  Split split;
  Draw draw;
  Add add;
  TwoPorts() {
    source(split);
    connect(split, 0, draw);
    connect(split, 1, add);
  }
};
