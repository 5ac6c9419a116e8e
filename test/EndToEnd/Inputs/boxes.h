// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Boxes of pixels that may lie anywhere, and stages that mark their pixels, each
// its own numbers.
#include <piko.h>

struct Seed {
  int x, y, width, height;
};
struct Pixel {
  int at[18] = {};
};
struct State {
  piko::Image<Pixel> image;
  piko::Image<int> copied;
  piko::Buffer<int> sums; // bound by the host
};

struct Box {
  glm::ivec2 lo, hi; // closed
};
static Box boxOf(const Seed &s) {
  glm::ivec2 lo(s.x % 80 - 5, s.y % 50 - 5);
  return {lo, lo + glm::ivec2(s.width & 31, s.height & 15)};
}

template <int K> struct Loops : piko::Stage<8, 8, 64, Seed>, piko::Uses<State> {
  void assignBin(const Seed &s) {
    Box b = boxOf(s);
    assignToBoundingBox(s, b.lo, b.hi);
  }

protected:
  Box clipped(const Seed &s) {
    Box b = boxOf(s);
    return {glm::max(b.lo, binLo()), glm::min(b.hi, binHi() - 1)};
  }
  void mark(int x, int y, int value) {
    update(state().image, {x, y},
           [&](Pixel &p) { p.at[K] = p.at[K] * 31 + value; });
  }
};
