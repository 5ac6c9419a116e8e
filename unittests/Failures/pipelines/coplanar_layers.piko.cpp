// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Coplanar layers with different triangles, of which the first is to be seen.
// `Interpolated` depth is rounded otherwise in each triangle; `Supporting`
// depth is that of the plane that the layers share, which is the same number
// for all of them, so that the first among equals stays.
#include <piko.h>

#include "common/clip.h"

struct LayerTriangle {
  glm::vec4 a, b, c; // in clip space
  glm::vec3 plane;   // depth is plane.x * x + plane.y * y + plane.z at a pixel
  int layer;
};
struct Cell {
  float depth = 1;
  int layer = -1;
};
struct State {
  piko::Image<Cell> image;
};

struct Interpolated {
  static float at(const raster::Sample &s, const LayerTriangle &) {
    return s.depth;
  }
};

struct Supporting {
  static float at(const raster::Sample &s, const LayerTriangle &t) {
    return t.plane.x * float(s.pixel.x) + t.plane.y * float(s.pixel.y) +
           t.plane.z;
  }
};

template <class Depth>
struct Draw : piko::Stage<64, 64, 64, LayerTriangle>, piko::Uses<State> {
  void assignBin(const LayerTriangle &t) {
    raster::PixelBox box = project(t).box();
    assignToBoundingBox(t, box.lo, box.hi);
  }
  void process(const LayerTriangle &t) {
    project(t).rasterize([&](glm::ivec2 lo, glm::ivec2 hi,
                             auto f) { parallelForPixels(lo, hi, f); },
                         [&](const raster::Sample &s) {
                           float depth = Depth::at(s, t);
                           update(state().image, s.pixel, [&](Cell &cell) {
                             if (depth < cell.depth)
                               cell = {depth, t.layer};
                           });
                         });
  }

private:
  raster::ScreenPolygon project(const LayerTriangle &t) {
    return raster::ScreenPolygon(t.a, t.b, t.c, domain(), false);
  }
};

template <class Depth> struct Pipeline : piko::Pipe<State> {
  Draw<Depth> draw;
  Pipeline() { source(draw); }
};
struct InterpolatedLayers : Pipeline<Interpolated> {};
struct SupportingLayers : Pipeline<Supporting> {};
