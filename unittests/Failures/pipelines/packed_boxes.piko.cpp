// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Triangles that pass from a stage to the next with the box of their pixels:
// how often each pixel is drawn. `Packed` boxes have 16 bits a coordinate,
// which wrap in images of more than 32768 pixels a side; `Wide` ones have 32.
#include <piko.h>

#include "common/coverage.h"

struct SnappedTriangle {
  glm::ivec2 a, b, c; // in 1/256 pixel, clockwise on the screen
};
struct Cell {
  int draws = 0;
};
struct State {
  piko::Image<Cell> image;
};

struct Packed {
  SnappedTriangle triangle;
  glm::i16vec2 lo, hi;
};
struct Wide {
  SnappedTriangle triangle;
  glm::ivec2 lo, hi;
};

template <class Boxed>
struct Setup : piko::Stage<0, 0, 64, SnappedTriangle, Boxed> {
  using Corner = decltype(Boxed::lo);

  void process(const SnappedTriangle &t) {
    glm::ivec2 lo = glm::min(t.a, glm::min(t.b, t.c));
    glm::ivec2 hi = glm::max(t.a, glm::max(t.b, t.c));
    raster::PixelBox box = raster::pixelsBetween({lo.x, lo.y}, {hi.x, hi.y});
    box.lo = glm::max(box.lo, 0);
    box.hi = glm::min(box.hi, this->domain() - 1);
    if (!box.isEmpty())
      this->emit(Boxed{t, Corner(box.lo), Corner(box.hi)});
  }
};

template <class Boxed>
struct Draw : piko::Stage<64, 64, 64, Boxed>, piko::Uses<State> {
  void assignBin(const Boxed &b) {
    this->assignToBoundingBox(b, glm::ivec2(b.lo), glm::ivec2(b.hi));
  }
  void process(const Boxed &b) {
    const SnappedTriangle &t = b.triangle;
    raster::Edges edges({t.a.x, t.a.y}, {t.b.x, t.b.y}, {t.c.x, t.c.y});
    this->parallelForPixels(glm::ivec2(b.lo), glm::ivec2(b.hi),
                            [&](glm::ivec2 p) {
                              if (edges.cover(p.x, p.y))
                                this->update(this->state().image, p,
                                             [](Cell &cell) { ++cell.draws; });
                            });
  }
};

template <class Boxed> struct Pipeline : piko::Pipe<State> {
  Setup<Boxed> setup;
  Draw<Boxed> draw;
  Pipeline() {
    source(setup);
    connect(setup, 0, draw);
  }
};
struct PackedBoxes : Pipeline<Packed> {};
struct WideBoxes : Pipeline<Wide> {};
