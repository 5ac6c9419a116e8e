// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The reference executor for AArch64, by another compiler, gives what it gives here;
// and it refuses a program that contracts, as GCC does there unless it is told not to.
//
// REQUIRES: aarch64
// RUN: %cxx_after_header %s -o %t.here && %t.here > %t.expected
// RUN: %aarch64_cxx -std=c++20 -O1 -ffp-contract=off -fsigned-char -I %piko_include %s -o %t.there
// RUN: %aarch64_run %t.there | diff %t.expected -
// RUN: %aarch64_cxx -std=c++20 -O2 -ffp-contract=fast -I %piko_include %s -o %t.contracts
// RUN: not --crash %aarch64_run %t.contracts 2>&1 | FileCheck %s
// CHECK: this program contracts a * b + c; build it with -ffp-contract=off

#include <piko.h>

#include <cstdio>
#include <vector>

struct Point {
  glm::vec2 at;
  float z;
  int id;
};

struct Pixel {
  float z = 1e30f, sum = 0;
  int id = -1, whole = 0;
  char small = 0;
};

struct State {
  float scale = 1;
  piko::Image<Pixel> picture;
};

struct Draw : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToBin(p, binFromPosition(p.at)); }
  void process(const Point &p) {
    float shade = piko::sin(p.z) * state().scale + piko::exp(p.at.x) * p.at.y;
    update(state().picture, glm::ivec2(p.at), [&](Pixel &pixel) {
      pixel.sum = pixel.sum * 0.75f + shade;
      pixel.whole = piko::toInt(shade * 1e9f);
      pixel.small = static_cast<char>(p.id);
      if (p.z < pixel.z) {
        pixel.z = p.z;
        pixel.id = p.id;
      }
    });
  }
};

struct Points : piko::Pipe<State> {
  Draw draw;
  Points() { source(draw); }
};

int main() {
  Points pipe;
  pipe.setDomain({19, 11});
  pipe.state().scale = 3.7f;
  std::vector<Point> points;
  uint32_t seed = 1;
  auto random = [&] {
    seed = seed * 1664525u + 1013904223u;
    return float(seed >> 8) * 0x1p-24f;
  };
  for (int i = 0; i < 2000; ++i) {
    float x = random() * 19, y = random() * 11;
    points.push_back({{x, y}, random() * 50 - 25, i});
  }
  pipe.feed(pipe.draw, points);
  pipe.run();
  for (int y = 0; y < 11; ++y)
    for (int x = 0; x < 19; ++x) {
      const Pixel &p = pipe.state().picture({x, y});
      std::printf("%a %a %d %d %d\n", p.z, p.sum, p.id, p.whole, p.small);
    }
}
