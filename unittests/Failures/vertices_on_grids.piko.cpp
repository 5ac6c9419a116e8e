// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Vertices on grids, so that edges run exactly through pixel centres: how often
// each pixel is drawn. Without a fill rule a centre on an edge belongs to both
// triangles (Closed) or to none (Open). Float edges are exact on these scenes:
// only the rule counts.
#include <piko.h>

#include "common/coverage.h"

struct MeshTriangle {
  glm::vec2 a, b, c; // in pixels, clockwise on the screen
};
struct Cell {
  int draws = 0;
};
struct State {
  piko::Image<Cell> image;
};

template <class Covers>
struct Draw : piko::Stage<64, 64, 64, MeshTriangle>, piko::Uses<State> {
  glm::ivec2 lo(const MeshTriangle &t) {
    return glm::ivec2(glm::floor(glm::min(t.a, glm::min(t.b, t.c))));
  }
  glm::ivec2 hi(const MeshTriangle &t) {
    return glm::ivec2(glm::ceil(glm::max(t.a, glm::max(t.b, t.c))));
  }
  void assignBin(const MeshTriangle &t) {
    assignToBoundingBox(t, lo(t), hi(t));
  }
  void process(const MeshTriangle &t) {
    Covers covers(t);
    parallelForPixels(lo(t), hi(t), [&](glm::ivec2 p) {
      if (covers.holds(p))
        update(state().image, p, [](Cell &cell) { ++cell.draws; });
    });
  }
};

template <bool Closed> struct FloatEdges {
  glm::vec2 a, b, c;
  explicit FloatEdges(const MeshTriangle &t) : a(t.a), b(t.b), c(t.c) {}
  static bool isInside(glm::vec2 u, glm::vec2 v, glm::vec2 p) {
    float side = (v.x - u.x) * (p.y - u.y) - (v.y - u.y) * (p.x - u.x);
    return Closed ? side >= 0 : side > 0;
  }
  bool holds(glm::ivec2 pixel) const {
    glm::vec2 p = glm::vec2(pixel) + 0.5f;
    return isInside(a, b, p) && isInside(b, c, p) && isInside(c, a, p);
  }
};

struct FillRule {
  raster::Edges edges;
  explicit FillRule(const MeshTriangle &t)
      : edges(raster::snap(t.a), raster::snap(t.b), raster::snap(t.c)) {}
  bool holds(glm::ivec2 p) const { return edges.cover(p.x, p.y); }
};

template <class Covers> struct Pipeline : piko::Pipe<State> {
  Draw<Covers> draw;
  Pipeline() { source(draw); }
};
struct ClosedTriangles : Pipeline<FloatEdges<true>> {};
struct OpenTriangles : Pipeline<FloatEdges<false>> {};
struct FillRuleTriangles : Pipeline<FillRule> {};
