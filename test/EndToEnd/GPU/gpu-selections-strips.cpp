// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What pixels keep is selected by atomics also where primitives come in strips:
// positions are those in a strip, so that of equal keys the word of a later strip
// may be less. What decides is the order of all strips.
// RUN: %compare_targets %s --cases %s --domain 24 16 --count 600 --runs 1
// CASE: --pipe Nearest --strip 7
// CASE: --pipe Last --strip 7
// CASE: --pipe TwoWords --strip 7
// CASE: --pipe TwoWords --strip 300
// CASE: --pipe Tests --strip 64
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=5 piko-compare %s --cases %s --domain 24 16 --count 600 --runs 2 --threads 2 --target cuda
// With a budget the host leads the strips, and finds their sizes.
// RUN: env PIKO_CUDA_DRIVER=%test_driver piko-compare %s --pipe TwoWords --domain 24 16 --count 600 --runs 2 --threads 2 --target cuda --budget 50000000 | FileCheck %s
// CHECK: {{^equal$}}
//
// RUN: pikoc %s --pipe Last --target cuda --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=SHARED
// RUN: pikoc %s --pipe Tests --target cuda --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=SHARED
// SHARED: stage 'draw' finds out by atomic operations which primitive a pixel is of
#include "../Inputs/ports.h"

struct Pixel {
  float z = 9;
  int group = 3;
  int tag = -1;
};
struct Wide {
  double z = 9;
  int of = -1;
};
struct State {
  piko::Image<Pixel> pixels;
  piko::Image<Wide> wide;
};

/// Each point comes to some pixels, with few keys.
struct Spread : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    for (int i = 0; i < 1 + p.tag % 3; ++i)
      emit({(p.x + 5 * i) % domain().x, (p.y + 3 * i) % domain().y,
            float((p.tag * 7 + i) % 4) - (i == 2 ? 0.0f : 1.0f), p.tag});
  }
};

template <class Draw> struct InStrips : piko::Pipe<State> {
  Spread spread;
  Draw draw;
  InStrips() {
    source(spread);
    connect(spread, 0, draw);
  }
};

/// Stages by themselves that do something for the pixels of a box.
struct Drawing : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::LoadBalance); }
  void forBox(const Point &p, auto &&body) const {
    for (int y = p.y; y < std::min(p.y + 1 + p.tag % 2, domain().y); ++y)
      for (int x = p.x; x < std::min(p.x + 1 + p.tag % 3, domain().x); ++x)
        body(glm::ivec2(x, y));
  }
};

/// The first one of the least.
struct DrawNearest : Drawing {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 at) {
      update(state().pixels, at, [&](Pixel &q) {
        if (p.value < q.z) {
          q.z = p.value;
          q.tag = p.tag;
        }
      });
    });
  }
};
struct Nearest : InStrips<DrawNearest> {};

/// The last one of the greatest, and what is carried.
struct DrawLast : Drawing {
  void process(const Point &p) {
    float z = -p.value;
    forBox(p, [&](glm::ivec2 at) {
      bool kept = false;
      update(state().pixels, at, [&](Pixel &q) {
        kept = z <= q.z;
        if (kept)
          q.z = z;
      });
      if (kept)
        update(state().wide, at, [&](Wide &w) { w.of = p.tag; });
    });
  }
};
struct Last : InStrips<DrawLast> {};

/// A key that with the position takes two words; the second one may be greater
/// than that of a strip before.
struct DrawTwoWords : Drawing {
  void process(const Point &p) {
    int group = p.tag % 5 - 2;
    double z = p.value;
    forBox(p, [&](glm::ivec2 at) {
      update(state().wide, at, [&](Wide &w) {
        if (z < w.z || (z == w.z && group > w.of)) {
          w.z = z;
          w.of = group;
        }
      });
    });
  }
};
struct TwoWords : InStrips<DrawTwoWords> {};

/// As a depth test with a minimum alone.
struct DrawTests : Drawing {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 at) {
      update(state().pixels, at,
             [&](Pixel &q) { q.z = piko::min(q.z, p.value); });
    });
  }
};
struct Tests : InStrips<DrawTests> {};
