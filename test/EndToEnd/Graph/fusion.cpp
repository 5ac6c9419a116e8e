// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages that become one: through a loop and a condition, with two ports, with
// an array that a computed index reads, and with a shader behind whose back the
// test comes first.
// RUN: pikoc %s --pipe Chain --emit=kernels --remarks -o %t.mlir 2>&1 | FileCheck %s --check-prefix=REMARK
// RUN: FileCheck %s --check-prefix=KERNEL --input-file=%t.mlir
// REMARK-DAG: stage 'shade' keeps each primitive in the bin
// REMARK-DAG: stage 'count' keeps each primitive in the bin
// REMARK-DAG: stage 'shade' runs inside stage 'spread'
// REMARK-DAG: stage 'test' runs inside stage 'spread'
// REMARK-DAG: stage 'count' runs inside stage 'spread'
// KERNEL: piko.stage @spread {{.*}} fused ["shade", "test", "count"]
//
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Chain --domain 67 35 --count 2000
// CASE: --pipe Large --domain 67 35 --count 500
// CASE: --pipe Whole --domain 67 35 --count 500
// RUN: %if all %{ piko-compare %s --pipe Chain --domain 67 35 --count 500 --without fuse-stages | FileCheck %s %}
// RUN: %if all %{ piko-compare %s --pipe Large --domain 67 35 --count 500 --without infer-directives | FileCheck %s %}
// RUN: %if all %{ piko-compare %s --pipe Whole --domain 67 35 --count 500 --without test-early,own-pixels | FileCheck %s %}
// RUN: not piko-compare %s --pipe Chain --without fusion 2>&1 | FileCheck %s --check-prefix=WRONG
// WRONG: --without: expected passes of pre-schedule, infer-directives, {{.*}} but got 'fusion'
// CHECK: equal
#include <piko.h>

struct Seed {
  float x, y;
  int size;
};
struct Splat {
  glm::ivec2 pixel;
  float depth;
  float weight[4];
};
struct Shaded {
  glm::ivec2 pixel;
  float depth;
  glm::vec3 color;
};
struct Depth {
  float z = 1;
};
struct Color {
  glm::vec3 rgb;
};
struct State {
  piko::Image<Depth> depth;
  piko::Image<Color> color, order;
  piko::Buffer<int> table;
};

// Emits every second pixel of a box that is cut at the bin; the others twice.
template <int Bin>
struct Spread : piko::Stage<Bin, Bin, 64, Seed, Splat, int>, piko::Uses<State> {
  static glm::ivec2 low(const Seed &s) {
    return {piko::toInt(piko::abs(s.x)) % 90, piko::toInt(piko::abs(s.y)) % 50};
  }
  void assignBin(const Seed &s) {
    glm::ivec2 lo = low(s);
    this->assignToBoundingBox(s, lo, lo + (s.size & 7));
  }
  void schedule(piko::BinId) { this->specifySchedule(piko::DirectMap); }
  void process(const Seed &s) {
    glm::ivec2 lo = glm::max(low(s), this->binLo());
    glm::ivec2 hi = glm::min(low(s) + (s.size & 7) + 1, this->binHi());
    for (int y = lo.y; y < hi.y; ++y)
      for (int x = lo.x; x < hi.x; ++x) {
        float z = float((x * 7 + y * 3 + s.size) & 31) / 32;
        Splat splat{{x, y}, z, {z, 0.5f, s.x, s.y}};
        this->emit(splat, 0);
        if ((x + y) & 1) {
          this->emit(x, 1);
          splat.depth = z * 0.75f;
          this->emit(splat, 0);
        }
      }
  }
};

template <int Bin>
struct Shade : piko::Stage<Bin, Bin, 64, Splat, Shaded>, piko::Uses<State> {
  void assignBin(const Splat &s) {
    if (s.depth < 0.9f)
      this->assignToBin(s, this->binFromPosition(s.pixel));
  }
  void process(const Splat &s) {
    float sum = 0;
    for (int i = 0; i < s.pixel.x % 9; ++i)
      sum += piko::sqrt(piko::abs(s.weight[(i + s.pixel.y) & 3]));
    this->emit({s.pixel, s.depth, glm::vec3(sum, s.depth, s.weight[1])}, 0);
  }
};

// Hands the pixels on that come nearer than all before.
template <int Bin>
struct Test : piko::Stage<Bin, Bin, 64, Shaded, glm::ivec2>, piko::Uses<State> {
  void assignBin(const Shaded &s) { this->assignToPreviousBins(s); }
  void schedule(piko::BinId) { this->specifySchedule(piko::DirectMap); }
  void process(const Shaded &s) {
    bool passed = this->update(this->state().depth, s.pixel, [&](Depth &d) {
      bool nearer = s.depth < d.z;
      if (nearer)
        d.z = s.depth;
      return nearer;
    });
    if (!passed)
      return;
    this->update(this->state().color, s.pixel,
                 [&](Color &c) { c.rgb = c.rgb * 0.5f + s.color; });
    this->emit(s.pixel, 0);
  }
};

template <int Bin>
struct Count : piko::Stage<Bin, Bin, 64, glm::ivec2>, piko::Uses<State> {
  void assignBin(const glm::ivec2 &p) {
    this->assignToBin(p, this->binFromPosition(p));
  }
  void process(const glm::ivec2 &p) {
    piko::atomicAdd(this->state().table[p.x % 8], p.y + 1);
  }
};

// In one bin after the other: the order of what a bin gets shows in its hash.
struct Collect : piko::Stage<16, 16, 64, int>, piko::Uses<State> {
  void assignBin(const int &x) {
    assignToBin(x, binFromPosition(glm::ivec2(x, 0)));
  }
  void process(const int &x) {
    update(state().order, glm::ivec2(x, 0),
           [&](Color &c) { c.rgb.y = c.rgb.y * 0.75f + float(x); });
  }
};

template <int Bin> struct Pipeline : piko::Pipe<State> {
  Spread<Bin> spread;
  Shade<Bin> shade;
  Test<Bin> test;
  Count<Bin> count;
  Collect collect;
  Pipeline() {
    this->source(spread);
    this->connect(spread, 0, shade);
    this->connect(spread, 1, collect);
    this->connect(shade, 0, test);
    this->connect(test, 0, count);
  }
};

struct Chain : Pipeline<8> {};
struct Large : Pipeline<32> {};
struct Whole : Pipeline<0> {};
