// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A source in strips, however they are cut: by the tile of `All`, by the host,
// by a budget. Branches meet again, two stages update pixels in lineage order, a
// loop runs to its end in each strip, and a list gets what all of them left.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --count 2000
// CASE: --count 300 --strip 1
// CASE: --count 1000 --strip 7
// CASE: --count 5000 --budget 4000000
//
// RUN: pikoc %s --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=REMARK
// REMARK: strips.cpp:{{.*}}: remark: stage 'gather' does not run in strips: its process phase takes a list
#include "../Inputs/ports.h"

struct Pixel {
  float sum = 0;
  int last = -1;
};
struct State {
  piko::Image<Pixel> image, second;
  piko::Buffer<int> counts;
  piko::Buffer<float> sums;
};

struct Split : piko::Stage<0, 0, 64, Point, Point, Point> {
  void schedule(piko::BinId) { specifySchedule(piko::All, 500); }
  void process(const Point &p) {
    for (int i = 0; i < p.tag % 8; ++i) {
      Point q = p;
      q.x = (p.x + i * 5) % domain().x;
      q.tag = i;
      q.value = p.value * float(i + 1);
      if (i % 3 == 0)
        emit(q, 1);
      else
        emit(q, 0);
    }
  }
};
struct Shift : piko::Stage<8, 8, 64, Point, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x + 8, p.y));
  }
  void process(const Point &p) {
    Point q = p;
    q.tag -= 1;
    if (p.tag > 2)
      emit(q, 0); // again
    else
      emit(q, 1);
  }
};
struct Draw : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    if (!isOnScreen(p, domain()))
      return;
    update(state().image, glm::ivec2(p.x, p.y), [&](Pixel &pixel) {
      pixel.sum = pixel.sum * 0.5f + p.value;
      pixel.last = p.tag;
    });
    emit(p);
  }
};
struct DrawAgain : piko::Stage<4, 4, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Point &p) {
    update(state().second, glm::ivec2(p.x, p.y), [&](Pixel &pixel) {
      pixel.sum = pixel.sum * 0.25f + p.value;
      pixel.last = p.tag;
    });
    piko::atomicAdd(state().counts[p.tag & 63], 1);
    if (p.tag == 0)
      emit(p);
  }
};
struct Gather : piko::Stage<32, 32, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const piko::List<Point> &list) {
    float sum = 0;
    for (const Point &p : list)
      sum = sum * 0.5f + p.value;
    state().sums[bin().index & 63] = sum;
  }
};
struct Strips : piko::Pipe<State> {
  Split split;
  Shift shift;
  Draw draw;
  DrawAgain drawAgain;
  Gather gather;
  Strips() {
    source(split);
    connect(split, 0, shift);
    connect(split, 1, draw);
    connect(shift, 0, shift);
    connect(shift, 1, draw);
    connect(draw, 0, drawAgain);
    connect(drawAgain, 0, gather);
  }
};
