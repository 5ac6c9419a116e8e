// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is nearest, by two kinds of depth buffer. `Fixed24` has z / w in 24
// bits, most of which are spent next to the near plane; `Reversed` has 1 / w as
// a float, large where it is near, so that its relative precision is the same
// at all distances.
#include <piko.h>

#include "common/clip.h"

struct LayerTriangle {
  glm::vec4 a, b, c; // in clip space
  int layer;
};
template <class Depth> struct Cell {
  Depth nearest{};
  int layer = -1;
};
template <class Depth> struct State {
  piko::Image<Cell<Depth>> image;
};

struct Fixed24 {
  uint32_t value = 0xffffff;
  static Fixed24 of(const raster::Sample &s, glm::vec3) {
    return {piko::toUint((s.depth * 0.5f + 0.5f) * 0xffffff + 0.5f)};
  }
  bool isBefore(const Fixed24 &other) const { return value < other.value; }
};

struct Reversed {
  float value = 0;
  static Reversed of(const raster::Sample &s, glm::vec3 w) {
    return {1 / glm::dot(s.weight, w)};
  }
  bool isBefore(const Reversed &other) const { return value > other.value; }
};

template <class Depth>
struct Draw : piko::Stage<64, 64, 64, LayerTriangle>, piko::Uses<State<Depth>> {
  void assignBin(const LayerTriangle &t) {
    raster::PixelBox box = project(t).box();
    this->assignToBoundingBox(t, box.lo, box.hi);
  }
  void process(const LayerTriangle &t) {
    project(t).rasterize([&](glm::ivec2 lo, glm::ivec2 hi,
                             auto f) { this->parallelForPixels(lo, hi, f); },
                         [&](const raster::Sample &s) {
                           Depth depth = Depth::of(s, {t.a.w, t.b.w, t.c.w});
                           this->update(this->state().image, s.pixel,
                                        [&](Cell<Depth> &cell) {
                                          if (depth.isBefore(cell.nearest))
                                            cell = {depth, t.layer};
                                        });
                         });
  }

private:
  raster::ScreenPolygon project(const LayerTriangle &t) {
    return raster::ScreenPolygon(t.a, t.b, t.c, this->domain(), false);
  }
};

template <class Depth> struct Pipeline : piko::Pipe<State<Depth>> {
  Draw<Depth> draw;
  Pipeline() { this->source(draw); }
};
struct FixedDepth : Pipeline<Fixed24> {};
struct ReversedDepth : Pipeline<Reversed> {};
