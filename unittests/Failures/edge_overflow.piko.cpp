// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Edge functions of corners in 1/256 pixel, on a strip of a large image: which
// triangle is drawn, and how often. `Naive` has them in 32 bits, which an edge
// across an image of 182 pixels a side may overflow; ours in 64.
#include <piko.h>

#include "common/coverage.h"

struct SnappedTriangle {
  glm::ivec2 a, b, c; // in 1/256 pixel, clockwise on the screen
  int index;
};
struct Cell {
  int draws = 0, triangle = -1;
};
struct State {
  int top = 0; // the image's row that is the strip's first
  piko::Image<Cell> image;
};

template <class Int>
struct Draw : piko::Stage<64, 64, 64, SnappedTriangle>, piko::Uses<State> {
  void assignBin(const SnappedTriangle &t) {
    raster::PixelBox box = boxOf(t);
    assignToBoundingBox(t, box.lo, box.hi);
  }
  void process(const SnappedTriangle &t) {
    raster::PixelBox box = boxOf(t);
    raster::BasicEdges<Int> edges({t.a.x, t.a.y}, {t.b.x, t.b.y},
                                  {t.c.x, t.c.y});
    parallelForPixels(box.lo, box.hi, [&](glm::ivec2 p) {
      if (edges.cover(p.x, p.y + state().top))
        update(state().image, p, [&](Cell &cell) {
          ++cell.draws;
          cell.triangle = t.index;
        });
    });
  }

private:
  raster::PixelBox boxOf(const SnappedTriangle &t) {
    glm::ivec2 lo = glm::min(t.a, glm::min(t.b, t.c));
    glm::ivec2 hi = glm::max(t.a, glm::max(t.b, t.c));
    raster::PixelBox box = raster::pixelsBetween({lo.x, lo.y}, {hi.x, hi.y});
    box.lo.y -= state().top;
    box.hi.y -= state().top;
    return box;
  }
};

template <class Int> struct Pipeline : piko::Pipe<State> {
  Draw<Int> draw;
  Pipeline() { source(draw); }
};
struct NaiveEdgeOverflow : Pipeline<int32_t> {};
struct WideEdgeOverflow : Pipeline<int64_t> {};
