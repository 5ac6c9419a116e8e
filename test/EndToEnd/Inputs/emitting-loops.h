// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages that emit the pixels of boxes, and stages that draw what they emit, each
// a number of its own.
#include <piko.h>

#include <algorithm>
#include <array>

struct Seed {
  float x, y;
  int width, height;
};
struct Cell {
  int x, y, id;
};
struct Pixel {
  std::array<int, 9> drawn{};
};
struct State {
  piko::Image<Pixel> image;
};

struct Box {
  glm::ivec2 lo, hi; // closed
  int id;
};
static Box boxOf(const Seed &s) {
  glm::ivec2 lo(piko::toInt(s.x) % 80 - 5, piko::toInt(s.y) % 50 - 5);
  return {lo, lo + glm::ivec2(s.width & 31, s.height & 15), s.width};
}

template <int K> struct Sink : piko::Stage<8, 8, 64, Cell>, piko::Uses<State> {
  void assignBin(const Cell &c) {
    this->assignToBin(c, this->binFromPosition(glm::ivec2(c.x, c.y)));
  }
  void process(const Cell &c) {
    this->update(this->state().image, {c.x, c.y},
                 [&](Pixel &p) { p.drawn[K] = p.drawn[K] * 31 + c.id; });
  }
};
struct Loops : piko::Stage<8, 8, 64, Seed, Cell> {
  void assignBin(const Seed &s) {
    Box b = boxOf(s);
    assignToBoundingBox(s, b.lo, b.hi);
  }
};
