// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Initial values and what images are cleared to are evaluated as Clang does:
// loops of any length, in functions and constructors that are constexpr or have
// bodies that can be evaluated, or that can be once mathematics is compiled.
// RUN: pikoc %s --emit=authored | FileCheck %s

#include <array>
#include <cmath>
#include <piko.h>

constexpr std::array<float, 16> squares() {
  std::array<float, 16> values{};
  for (int i = 0; i < 16; ++i)
    values[i] = float(i * i);
  return values;
}
struct Triangle {
  int64_t sums[40];
  Triangle() {
    sums[0] = 0;
    for (int i = 1; i < 40; ++i)
      sums[i] = sums[i - 1] + i;
  }
};
struct Waves {
  float values[8];
  Waves() {
    for (int i = 0; i < 8; ++i)
      values[i] = std::sqrt(float(i)); // no constant expression
  }
};
enum class Kind : short { A = 3, B = -4 };
struct Mixed {
  char c = 'x';
  double d[2] = {0.5};
  union {
    float f;
    uint32_t bits;
  };
  Kind kinds[2][2];
  constexpr Mixed() : bits(0x3f800000), kinds{{Kind::A}, {Kind::B, Kind::A}} {}
};
struct Pixel {
  glm::vec2 samples[9];
  constexpr Pixel() : samples() {
    for (int i = 0; i < 9; ++i)
      samples[i] = glm::vec2(i, -i);
  }
};
unsigned next(unsigned x) { return x * 1664525u + 1013904223u; }
unsigned jump(int n) {
  unsigned x = 1;
  while (n-- > 0)
    x = next(x);
  return x;
}
struct Base {
  int inBase;
  float unset;
};
struct State : Base {
  std::array<float, 16> kernel = squares();
  Triangle triangle;
  Mixed mixed;
  unsigned seed = jump(2000000);
  int three = 3, six = 2 * three;
  std::array<int, 5000> table = [] {
    std::array<int, 5000> t{};
    for (int i = 0; i < 5000; ++i)
      t[i] = 5000 - i;
    return t;
  }();
  piko::Image<Pixel> pixels;
  piko::Image<Waves> waves;
};
// A constructor of the state, too.
struct Constructed : State {
  int own;
  Constructed() { inBase = 7, own = 8, three = 4; }
};

// CHECK: piko.constant @inBase : @int value [7 : i32]
// CHECK: piko.constant @unset : @float{{$}}
// CHECK: piko.constant @kernel {{.*}} value [0.000000e+00 : f32, 1.000000e+00 : f32, 4.000000e+00 : f32, {{.*}}, 2.250000e+02 : f32]
// CHECK: piko.constant @triangle {{.*}} value [0, 1, 3, 6, {{.*}}, 780]
// CHECK: piko.constant @mixed {{.*}} value [120 : i8, 5.000000e-01, 0.000000e+00, 1.000000e+00 : f32, 3 : i16, 0 : i16, -4 : i16, 3 : i16]
// CHECK: piko.constant @seed {{.*}} value [{{-?[1-9].*}} : i32]
// CHECK: piko.constant @three {{.*}} value [4 : i32]
// CHECK: piko.constant @six {{.*}} value [6 : i32]
// CHECK: piko.constant @table {{.*}} value [5000 : i32, 4999 : i32, {{.*}}, 1 : i32]
// CHECK: piko.image @pixels {{.*}} clear [0.000000e+00 : f32, 1.000000e+00 : f32, {{.*}}, 8.000000e+00 : f32, {{-?}}0.000000e+00 : f32, -1.000000e+00 : f32, {{.*}}, -8.000000e+00 : f32]
// CHECK: piko.image @waves {{.*}} clear [0.000000e+00 : f32, 1.000000e+00 : f32, 1.41421354 : f32, {{.*}}, 2.64575124 : f32]
// CHECK: piko.constant @own : @int value [8 : i32]
// A member of a stage is filled before the stages are connected.
// CHECK: piko.source @put
// CHECK: piko.stage @put {{.*}}
// CHECK-NOT: piko.schedule {
// CHECK: piko.process
struct Put : piko::Stage<8, 8, 64, int>, piko::Uses<Constructed> {
  float table[100];
  Put() {
    for (int i = 0; i < 100; ++i)
      table[i] = i;
  }
  void assignBin(const int &) { assignToAll(0); }
  void schedule(piko::BinId) { specifySchedule(piko::DirectMap); }
  void process(const int &i) {
    parallelForPixels([&](glm::ivec2 at) {
      update(state().pixels, at,
             [&](Pixel &p) { p.samples[0].x += table[i % 100]; });
    });
  }
};
struct P : piko::Pipe<Constructed> {
  Put put;
  P() { source(put); }
};
