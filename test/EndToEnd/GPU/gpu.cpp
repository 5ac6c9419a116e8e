// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Kernels for a GPU, run on the CPU by blocks and threads: each thread has
// pixels of its own, and the updates of a pixel keep their order.
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Boxes --count 600
// CASE: --pipe Boxes --count 200 --strip 13 --domain 61 43 --wide
// CASE: --pipe Whole --count 400
// RUN: piko-compare %s --pipe Boxes --count 600 --target gpu-on-cpu --gpu-threads 1 --runs 1 --threads 2 | FileCheck %s
// RUN: piko-compare %s --pipe Boxes --count 600 --target gpu-on-cpu --gpu-threads 32 --runs 1 | FileCheck %s
// RUN: piko-compare %s --pipe Boxes --count 600 --target gpu-on-cpu --gpu-threads 256 --gpu-seed 5 --runs 1 --threads 2 | FileCheck %s
// RUN: piko-compare %s --pipe Boxes --count 200 --target gpu-on-cpu --gpu-threads 8 --runs 1 --strip 13 --domain 61 43 --wide | FileCheck %s
// RUN: piko-compare %s --pipe Whole --count 400 --target gpu-on-cpu --gpu-threads 4 --runs 1 --threads 2 | FileCheck %s
// CHECK: equal
// PTX does so, too, behind the driver for tests.
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=7 piko-compare %s --pipe Boxes --count 200 --gpu-threads 8 --strip 13 --domain 61 43 --wide --target cuda --runs 1 --threads 2 | FileCheck %s
// RUN: env PIKO_CUDA_DRIVER=%test_driver piko-compare %s --pipe Whole --count 400 --gpu-threads 4 --target cuda --runs 1 --threads 2 | FileCheck %s
// Of several errors, it is the one that a CPU reports.
// RUN: not piko-compare %s --pipe Stops --count 500 --runs 1 --target gpu-on-cpu --gpu-threads 32 | FileCheck %s --check-prefix=STOPS
// RUN: not piko-compare %s --pipe Stops --count 500 --runs 1 --target gpu-on-cpu --gpu-threads 64 --gpu-seed 5 | FileCheck %s --check-prefix=STOPS
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=3 not piko-compare %s --pipe Stops --count 500 --runs 1 --target cuda --gpu-threads 32 | FileCheck %s --check-prefix=STOPS
// STOPS-COUNT-3: got: stage 'draw', bin {{[0-9]+}}: expected an index into 'limits' in [0, 64), but got -2{{$}}
// A pixel is under a test, or loops step from one of a thread's own to the next.
// RUN: pikoc %s --pipe Boxes --emit=gpu --gpu-threads 8 | FileCheck %s --check-prefix=GPU
// GPU-LABEL: gpu.func @Boxes_kernel_draw
// GPU-SAME:    workgroup({{.*}}memref<{{[0-9]+x[if][0-9]+}}, #gpu.address_space<workgroup>>
// GPU-COUNT-2: gpu.barrier
#include "../Inputs/ports.h"

struct Pixel {
  float value = 1;
  int passes = 0;
};
struct Mark {
  int last = -1;
  float sum = 0;
};
struct Count {
  int hits;
};
struct State {
  piko::Image<Pixel> image;
  piko::Image<Mark> marks;
  piko::Buffer<Count> counts;
  piko::Buffer<Count> limits;
};

struct Box {
  glm::ivec2 lo, hi;
  float value;
  int tag;
};

struct Grow : piko::Stage<0, 0, 64, Point, Box> {
  void process(const Point &p) {
    if (p.x >= 0 && p.y >= 0)
      emit(Box{{p.x - (p.tag & 7), p.y - (p.tag & 3)},
               {p.x + (p.tag & 15), p.y + 5},
               p.value,
               p.tag});
  }
};

template <int Bin>
struct Draw : piko::Stage<Bin, Bin, 64, Box>, piko::Uses<State> {
  void assignBin(const Box &b) { this->assignToBoundingBox(b, b.lo, b.hi); }

  void process(const Box &b) {
    glm::ivec2 lo = glm::max(b.lo, this->binLo());
    glm::ivec2 hi = glm::min(b.hi + 1, this->binHi());
    // A loop that steps, and in it one that carries a number from pixel to
    // pixel and one that does not.
    for (int y = lo.y; y < hi.y; ++y) {
      float edge = b.value + float(lo.x - b.lo.x) * 0.25f;
      for (int x = lo.x; x < hi.x; ++x) {
        paint(b, {x, y}, edge);
        edge += 0.25f;
      }
      for (int64_t x = lo.x; x < hi.x; ++x)
        if ((x + y) % 3 == 0)
          this->update(state().marks, glm::ivec2(x, y), [&](Mark &m) {
            m.last = b.tag;
            m.sum = m.sum * 0.5f + float(x);
          });
    }
    // One pixel that no loop counts through.
    if (lo.x < hi.x && lo.y < hi.y)
      paint(b, lo, std::sqrt(b.value * b.value));
  }

private:
  using piko::Uses<State>::state;

  void paint(const Box &b, glm::ivec2 at, float value) {
    bool passed = false;
    this->update(state().image, at, [&](Pixel &pixel) {
      passed = value < pixel.value;
      pixel.value = passed ? value : pixel.value * 0.875f;
      ++pixel.passes;
    });
    if (passed)
      piko::atomicAdd(state().counts[b.tag & 31].hits, 1);
  }
};

template <int Bin> struct Drawn : piko::Pipe<State> {
  Grow grow;
  Draw<Bin> draw;
  Drawn() {
    source(grow);
    connect(grow, 0, draw);
  }
};
struct Boxes : Drawn<16> {};
struct Whole : Drawn<0> {};

struct Pick : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    if (isOnScreen(p, domain()))
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Point &p) {
    int limit = state().limits[p.tag * 2 - 20].hits;
    update(state().image, glm::ivec2(p.x, p.y),
           [&](Pixel &pixel) { pixel.passes += limit; });
  }
};
struct Stops : piko::Pipe<State> {
  Pick draw;
  Stops() { source(draw); }
};
