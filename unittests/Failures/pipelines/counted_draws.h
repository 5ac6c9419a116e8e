// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How often each pixel is drawn by triangles on the screen, for the two
// families of scenes that ask which triangle a shared edge belongs to.
#ifndef UNITTESTS_FAILURES_COUNTED_DRAWS_H
#define UNITTESTS_FAILURES_COUNTED_DRAWS_H

#include <piko.h>

#include "common/coverage.h"

struct FlatTriangle {
  glm::vec2 a, b, c; // in pixels, clockwise on the screen
};
struct Cell {
  int draws = 0;
};
struct State {
  piko::Image<Cell> image;
};

template <class Covers>
struct Draw : piko::Stage<64, 64, 64, FlatTriangle>, piko::Uses<State> {
  glm::ivec2 lo(const FlatTriangle &t) {
    return glm::ivec2(glm::floor(glm::min(t.a, glm::min(t.b, t.c)))) - 1;
  }
  glm::ivec2 hi(const FlatTriangle &t) {
    return glm::ivec2(glm::ceil(glm::max(t.a, glm::max(t.b, t.c)))) + 1;
  }
  void assignBin(const FlatTriangle &t) {
    assignToBoundingBox(t, lo(t), hi(t));
  }
  void process(const FlatTriangle &t) {
    Covers covers(t);
    parallelForPixels(lo(t), hi(t), [&](glm::ivec2 p) {
      if (covers.holds(p))
        update(state().image, p, [](Cell &cell) { ++cell.draws; });
    });
  }
};

/// Edge functions in floats. A centre on an edge belongs to both triangles that
/// share it, or, if not Closed, to none.
template <bool Closed> struct FloatEdges {
  glm::vec2 a, b, c;
  explicit FloatEdges(const FlatTriangle &t) : a(t.a), b(t.b), c(t.c) {}
  static bool isInside(glm::vec2 u, glm::vec2 v, glm::vec2 p) {
    float side = (v.x - u.x) * (p.y - u.y) - (v.y - u.y) * (p.x - u.x);
    return Closed ? side >= 0 : side > 0;
  }
  bool holds(glm::ivec2 pixel) const {
    glm::vec2 p = glm::vec2(pixel) + 0.5f;
    return isInside(a, b, p) && isInside(b, c, p) && isInside(c, a, p);
  }
};

/// Corners on the grid, exact edge functions, and a fill rule.
struct ExactEdges {
  raster::Point a, b, c;
  explicit ExactEdges(const FlatTriangle &t)
      : a(raster::snap(t.a)), b(raster::snap(t.b)), c(raster::snap(t.c)) {}
  bool holds(glm::ivec2 p) const {
    return raster::signedArea(a, b, c) > 0 &&
           raster::Edges(a, b, c).cover(p.x, p.y);
  }
};

template <class Covers> struct CountedDraws : piko::Pipe<State> {
  Draw<Covers> draw;
  CountedDraws() { source(draw); }
};

#endif // UNITTESTS_FAILURES_COUNTED_DRAWS_H
