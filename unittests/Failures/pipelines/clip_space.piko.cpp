// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Triangles in clip space: which one is drawn, and how often. `Divided` divides
// all corners by w, wherever they are; `Clipped` clips at the near plane and
// at a guard band before it divides. Both have exact 64-bit edge functions.
#include <piko.h>

#include "common/clip.h"

#include <utility>

struct ClipTriangle {
  glm::vec4 a, b, c;
  int index;
};
struct Cell {
  int draws = 0, triangle = -1;
};
struct State {
  glm::ivec2 size{0};   // of the image
  glm::ivec2 origin{0}; // the image's pixel that is the domain's first
  piko::Image<Cell> image;
};

// Without clipping: as ScreenPolygon.
class DividedTriangle {
public:
  DividedTriangle(glm::vec4 a, glm::vec4 b, glm::vec4 c, glm::ivec2 size, bool)
      : points{project(a, size), project(b, size), project(c, size)} {
    if (raster::signedArea(points[0], points[1], points[2]) < 0)
      std::swap(points[1], points[2]);
  }
  raster::PixelBox box() const {
    auto [a, b, c] = points;
    return raster::pixelsBetween(
        {glm::min(glm::min(a.x, b.x), c.x), glm::min(glm::min(a.y, b.y), c.y)},
        {glm::max(glm::max(a.x, b.x), c.x), glm::max(glm::max(a.y, b.y), c.y)});
  }
  template <class Pixels, class Draw>
  void rasterize(Pixels pixels, Draw draw) const {
    raster::PixelBox area = box();
    raster::Edges edges(points[0], points[1], points[2]);
    pixels(area.lo, area.hi, [&](glm::ivec2 p) {
      if (edges.cover(p.x, p.y))
        draw(raster::Sample{p, 0, {}});
    });
  }

private:
  static raster::Point project(glm::vec4 clip, glm::ivec2 size) {
    glm::vec2 half = glm::vec2(size) * 0.5f, ndc = glm::vec2(clip) / clip.w;
    return raster::snap({half.x + ndc.x * half.x, half.y - ndc.y * half.y});
  }

  raster::Point points[3];
};

template <class Polygon>
struct Draw : piko::Stage<64, 64, 64, ClipTriangle>, piko::Uses<State> {
  Polygon project(const ClipTriangle &t) {
    return Polygon(t.a, t.b, t.c, state().size, false);
  }
  void assignBin(const ClipTriangle &t) {
    raster::PixelBox box = project(t).box();
    assignToBoundingBox(t, box.lo - state().origin, box.hi - state().origin);
  }
  void process(const ClipTriangle &t) {
    glm::ivec2 origin = state().origin;
    project(t).rasterize(
        [&](glm::ivec2 lo, glm::ivec2 hi, auto f) {
          parallelForPixels(lo - origin, hi - origin,
                            [&](glm::ivec2 p) { f(p + origin); });
        },
        [&](const raster::Sample &s) {
          update(state().image, s.pixel - origin, [&](Cell &cell) {
            ++cell.draws;
            cell.triangle = t.index;
          });
        });
  }
};

template <class Polygon> struct Pipeline : piko::Pipe<State> {
  Draw<Polygon> draw;
  Pipeline() { source(draw); }
};
struct DividedTriangles : Pipeline<DividedTriangle> {};
struct ClippedTriangles : Pipeline<raster::ScreenPolygon> {};
