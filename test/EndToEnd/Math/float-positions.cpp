// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Positions in floats that were whole coordinates, or the middles of pixels, are
// exact, because the domain must not be larger than that: a shader that gets its
// bin from one runs inside the rasterizer.
// REQUIRES: all
// RUN: pikoc %s --pipe Corners --emit=kernels --remarks -o %t.mlir 2>&1 | FileCheck %s --check-prefix=FUSED
// RUN: pikoc %s --pipe Middles --emit=kernels --remarks -o %t.mlir 2>&1 | FileCheck %s --check-prefix=FUSED
// RUN: FileCheck %s --check-prefix=LIMIT --input-file=%t.mlir
// RUN: pikoc %s --pipe Fused --emit=kernels --remarks -o %t.mlir 2>&1 | FileCheck %s --check-prefix=FUSED
// FUSED: stage 'shade' keeps each primitive in the bin that it was emitted from
// FUSED: stage 'shade' runs inside stage 'rasterize'
// LIMIT: piko.pipeline @Middles rank 2 max_extent 8388608 {
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Corners --domain 67 35 --count 300
// CASE: --pipe Middles --domain 67 35 --count 300
// RUN: piko-compare %s --pipe Fused --domain 67 35 --count 300 --tolerance 0 | FileCheck %s
// RUN: piko-compare %s --pipe Middles --domain 67 35 --count 100 --without fuse-stages | FileCheck %s
// CHECK: equal
// RUN: not piko-compare %s --pipe Middles --domain 8388609 1 --count 9 --runs 1 | FileCheck %s --check-prefix=LARGE
// LARGE: expected: {{.*}}stage 'Shade': expected at most 8388608 cells in each dimension where positions are floats, but the domain has 8388609
// LARGE: got: pipeline 'Middles': expected at most 8388608 cells in each dimension where positions are floats, but the domain has 8388609
//
// Cells have no such limit.
// RUN: pikoc %s --pipe Cells --emit=authored -o - | FileCheck %s --check-prefix=CELLS
// CELLS: piko.pipeline @Cells rank 2 {
#include <piko.h>

struct Seed {
  int x, y, size;
};
struct Fragment {
  glm::vec2 screenPos;
  int value;
};
struct Pixel {
  int sum = 0, last = 0;
};
struct State {
  piko::Image<Pixel> image;
};

enum class Point { Corner, Middle, Fused };

template <Point P> struct Rasterize : piko::Stage<8, 8, 64, Seed, Fragment> {
  static glm::ivec2 low(const Seed &s) { return {s.x % 80 - 5, s.y % 50 - 5}; }
  void schedule(piko::BinId) {
    this->specifyPrecision(P == Point::Fused ? piko::Precision::Contracted
                                             : piko::Precision::Strict);
  }
  void assignBin(const Seed &s) {
    this->assignToBoundingBox(s, low(s), low(s) + (s.size & 15));
  }
  void process(const Seed &s) {
    glm::ivec2 lo = low(s), hi = lo + (s.size & 15);
    this->parallelForPixels(lo, hi, [&](glm::ivec2 p) {
      if constexpr (P == Point::Fused) // of multiply and add
        this->emit({glm::vec2(p.x * 2.0f + 1.0f, p.y * 2.0f + 1.0f) * 0.5f,
                    s.x ^ p.y});
      else if constexpr (P == Point::Middle)
        this->emit({glm::vec2(p.x + 0.5f, p.y + 0.5f), s.x ^ p.y});
      else
        this->emit({glm::vec2(p.x, p.y), s.x ^ p.x});
    });
  }
};

struct Shade : piko::Stage<8, 8, 64, Fragment>, piko::Uses<State> {
  void assignBin(const Fragment &f) {
    assignToBin(f, binFromPosition(f.screenPos));
  }
  void process(const Fragment &f) {
    update(state().image, glm::ivec2(f.screenPos), [&](Pixel &p) {
      p.sum += f.value;
      p.last = p.last * 31 + f.value;
    });
  }
};

template <Point P> struct Draw : piko::Pipe<State> {
  Rasterize<P> rasterize;
  Shade shade;
  Draw() {
    source(rasterize);
    connect(rasterize, 0, shade);
  }
};
struct Corners : Draw<Point::Corner> {};
struct Middles : Draw<Point::Middle> {};
struct Fused : Draw<Point::Fused> {};

struct Plain : piko::Stage<8, 8, 64, Seed>, piko::Uses<State> {
  void assignBin(const Seed &s) {
    if (piko::BinId bin = binFromPosition({s.x, s.y}); bin.index >= 0)
      assignToBin(s, bin);
  }
  void process(const Seed &s) {
    update(state().image, {s.x, s.y}, [&](Pixel &p) { p.sum += s.size; });
  }
};
struct Cells : piko::Pipe<State> {
  Plain plain;
  Cells() { source(plain); }
};
