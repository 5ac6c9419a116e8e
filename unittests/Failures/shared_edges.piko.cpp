// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Triangles that share edges: how often each pixel is drawn. `Naive` evaluates
// edge functions in floats, and counts a pixel on an edge as inside of both
// triangles; `Ours` snaps corners to 1/256 pixel and has exact edge functions
// with a fill rule.
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

struct FloatEdges {
  glm::vec2 a, b, c;
  explicit FloatEdges(const FlatTriangle &t) : a(t.a), b(t.b), c(t.c) {}
  static float edge(glm::vec2 u, glm::vec2 v, glm::vec2 p) {
    return (v.x - u.x) * (p.y - u.y) - (v.y - u.y) * (p.x - u.x);
  }
  bool holds(glm::ivec2 pixel) const {
    glm::vec2 p = glm::vec2(pixel) + 0.5f;
    return edge(a, b, p) >= 0 && edge(b, c, p) >= 0 && edge(c, a, p) >= 0;
  }
};

struct ExactEdges {
  raster::Point a, b, c;
  explicit ExactEdges(const FlatTriangle &t)
      : a(raster::snap(t.a)), b(raster::snap(t.b)), c(raster::snap(t.c)) {}
  bool holds(glm::ivec2 p) const {
    return raster::signedArea(a, b, c) > 0 &&
           raster::Edges(a, b, c).cover(p.x, p.y);
  }
};

template <class Covers> struct Pipeline : piko::Pipe<State> {
  Draw<Covers> draw;
  Pipeline() { source(draw); }
};
struct NaiveSharedEdges : Pipeline<FloatEdges> {};
struct ExactSharedEdges : Pipeline<ExactEdges> {};
