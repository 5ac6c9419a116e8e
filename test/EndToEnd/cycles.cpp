// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A stage that feeds itself at once, and one that takes lists and feeds itself in
// rounds.
// RUN: %compare_targets %s --cases %s
// CASE: --count 300
// CASE: --count 300 --strip 7
#include "Inputs/ports.h"

struct Pixel {
  float sum = 0;
};
struct State {
  piko::Image<Pixel> image;
};

struct Walk : piko::Stage<8, 8, 64, Point, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    if (p.tag > 0)
      emit({(p.x + 5) % 64, p.y, p.value + 1, p.tag - 7}, 0);
    emit(p, 1);
    if (p.tag > 20)
      emit({p.x, (p.y + 3) % 48, -p.value, p.tag - 20}, 0);
  }
};
struct Rounds : piko::Stage<16, 16, 64, Point, Point, Point> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 2, p.y), glm::ivec2(p.x, p.y));
  }
  void schedule(piko::BinId) { batch(5); }
  void process(const piko::List<Point> &list) {
    parallelFor(int(list.size()), [&](int i) {
      const Point &p = list[i];
      if (i % 2 == 0 && p.tag > 0)
        emit({(p.x + 16) % 64, p.y, p.value, p.tag / 4}, 0);
      emit({p.x, p.y, p.value * 0.5f, p.tag}, 1);
    });
  }
};
struct Blend : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x, p.y));
  }
  void process(const Point &p) {
    update(state().image, glm::ivec2(p.x, p.y),
           [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.75f + p.value; });
  }
};
struct Cycles : piko::Pipe<State> {
  Walk walk;
  Rounds rounds;
  Blend blend;
  Cycles() {
    source(walk);
    source(rounds);
    connect(walk, 0, walk);
    connect(walk, 1, rounds);
    connect(rounds, 0, rounds);
    connect(rounds, 1, blend);
  }
};
