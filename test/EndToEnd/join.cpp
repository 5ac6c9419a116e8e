// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A branch that joins: primitives on both paths arrive in lineage order, which
// the sum of each pixel shows, because it is not associative.
// RUN: %compare_targets %s --cases %s
// CASE: --count 5000
// CASE: --count 1000 --strip 7
#include "Inputs/ports.h"

struct Pixel {
  float sum = 0;
};
struct State {
  piko::Image<Pixel> image;
};

struct Split : piko::Stage<0, 0, 64, Point, Point, Point> {
  void process(const Point &p) {
    if (p.tag % 2 == 0)
      emit(p, 0);
    else
      emit(p, 1);
    Point q = p;
    q.value += 1;
    if (p.tag / 2 % 2 == 0)
      emit(q, 0);
    else
      emit(q, 1);
    emit(q, 0);
  }
};
struct Detour : piko::Stage<16, 16, 64, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 3, p.y - 3), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    Point q = p;
    q.value = -p.value + float(bin().index);
    emit(q, 0);
    emit(p, 0);
  }
};
struct Join : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const Point &p) {
    if (isOnScreen(p, domain()))
      update(state().image, glm::ivec2(p.x, p.y),
             [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.75f + p.value; });
  }
};
struct JoinPipe : piko::Pipe<State> {
  Split split;
  Detour detour;
  Join join;
  JoinPipe() {
    source(split);
    connect(split, 0, join);
    connect(split, 1, detour);
    connect(detour, 0, join);
  }
};
