// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Images cleared to records that hold arrays of records, which C++ fills in a
// loop.
// RUN: %compare_targets %s --domain 5 3 --count 4 | FileCheck %s
// CHECK: equal
#include <piko.h>

struct Part {
  uint16_t a;
  bool b;
  float c = 0.5f;
};
struct Pixel {
  int16_t first = 7;
  uint32_t hash;
  Part parts[3];
};
struct State {
  piko::Image<Pixel> image;
};

struct Draw : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) {
    update(state().image, glm::ivec2(i % domain().x, 1),
           [&](Pixel &pixel) { pixel.hash += 1; });
  }
};
struct ClearValues : piko::Pipe<State> {
  Draw draw;
  ClearValues() { source(draw); }
};
