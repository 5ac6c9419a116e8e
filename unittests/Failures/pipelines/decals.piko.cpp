// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Decals: what is painted on a surface, and is seen where the surface is.
// `Biased` moves them towards the eye by a constant; `Attached` ones are drawn
// where their surface is what is seen, whatever their own depth.
#include <piko.h>

#include "common/clip.h"

struct PaintedTriangle {
  glm::vec4 a, b, c; // in clip space
  int surface;       // its own, or, of a decal, that which it is painted on
  int decal;         // 0 for none
};
struct Cell {
  float depth = 1;
  int surface = -1, decal = 0;
};
struct State {
  piko::Image<Cell> image;
};

struct Biased {
  static constexpr float bias = 1e-4f;
  static bool isSeen(const PaintedTriangle &t, float depth, const Cell &cell) {
    return depth - (t.decal ? bias : 0) < cell.depth;
  }
};

struct Attached {
  static bool isSeen(const PaintedTriangle &t, float depth, const Cell &cell) {
    return t.decal ? t.surface == cell.surface : depth < cell.depth;
  }
};

template <class Method>
struct Draw : piko::Stage<64, 64, 64, PaintedTriangle>, piko::Uses<State> {
  void assignBin(const PaintedTriangle &t) {
    raster::PixelBox box = project(t).box();
    assignToBoundingBox(t, box.lo, box.hi);
  }
  void process(const PaintedTriangle &t) {
    project(t).rasterize([&](glm::ivec2 lo, glm::ivec2 hi,
                             auto f) { parallelForPixels(lo, hi, f); },
                         [&](const raster::Sample &s) {
                           update(state().image, s.pixel, [&](Cell &cell) {
                             if (Method::isSeen(t, s.depth, cell))
                               cell = {t.decal ? cell.depth : s.depth,
                                       t.surface, t.decal};
                           });
                         });
  }

private:
  raster::ScreenPolygon project(const PaintedTriangle &t) {
    return raster::ScreenPolygon(t.a, t.b, t.c, domain(), false);
  }
};

template <class Method> struct Pipeline : piko::Pipe<State> {
  Draw<Method> draw;
  Pipeline() { source(draw); }
};
struct BiasedDecals : Pipeline<Biased> {};
struct AttachedDecals : Pipeline<Attached> {};
