// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The updates of a pixel run in lineage order, in a bin that threads share and
// in small ones, after a stage that sends a primitive through several bins.
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Shared --count 20000
// CASE: --pipe Shared --count 2000 --strip 7
// CASE: --pipe Small --count 20000
#include "../Inputs/ports.h"

struct Pixel {
  float value = 0;
  int passes = 0;
};
struct State {
  piko::Image<Pixel> image;
};

struct Spread : piko::Stage<16, 16, 64, Point, Point> {
  void assignBin(const Point &p) {
    if (p.tag == 0)
      assignToAll(p);
    else
      assignToBoundingBox(p, glm::ivec2(p.x - p.tag, p.y),
                          glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    glm::ivec2 lo = binLo();
    Point q = p;
    q.x = lo.x + p.tag % 4;
    q.value = p.value * 0.5f + float(lo.x);
    emit(q);
    if (p.tag % 2 == 0)
      emit(p);
  }
};
template <int Bin>
struct Blend : piko::Stage<Bin, Bin, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, this->domain()))
      this->assignToBin(p, this->binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Point &p) {
    bool passed = false;
    this->update(state().image, glm::ivec2(p.x, p.y), [&](Pixel &pixel) {
      if (p.value > pixel.value) {
        pixel.value = p.value;
        passed = true;
      } else {
        pixel.value = pixel.value * 0.875f;
      }
      ++pixel.passes;
    });
    if (passed)
      this->emit(p);
  }
};
struct Drop : piko::Stage<0, 0, 64, Point> {
  void process(const Point &) {}
};
struct Shared : piko::Pipe<State> {
  Spread spread;
  Blend<0> blend;
  Drop drop;
  Shared() {
    source(spread);
    connect(spread, 0, blend);
    connect(blend, 0, drop);
  }
};
struct Small : piko::Pipe<State> {
  Spread spread;
  Blend<8> blend;
  Drop drop;
  Small() {
    source(spread);
    connect(spread, 0, blend);
    connect(blend, 0, drop);
  }
};
