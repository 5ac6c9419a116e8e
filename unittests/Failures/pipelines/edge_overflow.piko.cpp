// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Edge functions of corners in 1/256 pixel, on a strip of a large image: which
// triangle is drawn, and how often. `Naive` has them in 32 bits, which an edge
// across an image of 182 pixels a side may overflow; `Wide` in 64; and
// `Checked` in 32 where all is near and in 64 elsewhere.
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

using Wide = raster::Edges;
using Narrow = raster::NearEdges;

// Edges relative to a pixel, from which isNear() measures.
struct Checked {
  raster::Point first, second, third;
  bool isNear;

  Checked(raster::Point a, raster::Point b, raster::Point c)
      : first(a), second(b), third(c),
        isNear(raster::isNear(a) && raster::isNear(b) && raster::isNear(c)) {}
  bool cover(int x, int y) const {
    return isNear ? Narrow(first, second, third).cover(x, y)
                  : Wide(first, second, third).cover(x, y);
  }
};

template <class Edges>
struct Draw : piko::Stage<64, 64, 64, SnappedTriangle>, piko::Uses<State> {
  void assignBin(const SnappedTriangle &t) {
    raster::PixelBox box = boxOf(t);
    assignToBoundingBox(t, box.lo, box.hi);
  }
  void process(const SnappedTriangle &t) {
    raster::PixelBox box = boxOf(t);
    Edges edges({t.a.x, t.a.y}, {t.b.x, t.b.y}, {t.c.x, t.c.y});
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

template <class Edges> struct Pipeline : piko::Pipe<State> {
  Draw<Edges> draw;
  Pipeline() { source(draw); }
};
struct NaiveEdgeOverflow : Pipeline<Narrow> {};
struct WideEdgeOverflow : Pipeline<Wide> {};
struct CheckedEdgeOverflow : Pipeline<Checked> {};
