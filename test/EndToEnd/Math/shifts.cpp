// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The amount of a shift counts modulo the width of what is shifted, whatever it is:
// too large or negative, known when the pipeline is compiled or not, of vectors and
// in lanes.
// RUN: %compare_targets %s --cases %s --runs 1 --wide
// CASE: --pipe Shifts --count 64
// CASE: --pipe Fixed --count 64
// CASE: --pipe Lanes --domain 19 13 --count 5
// RUN: piko-compare %s --pipe Values --count 1 --runs 1 | FileCheck %s
// CHECK: equal
#include <piko.h>

struct In {
  int serial;
  uint32_t u;
  int32_t i;
  int64_t l;
  uint64_t v;
  int32_t by;
};
struct Out {
  uint32_t left, right;
  int32_t signedLeft, signedRight;
  int64_t wideLeft, wideRight;
  uint64_t wide;
  int32_t narrow;
  glm::ivec2 pair;
};
struct State {
  piko::Buffer<Out> out;
  piko::Buffer<uint32_t> results;
};

struct Variable : piko::Stage<0, 0, 64, In>, piko::Uses<State> {
  void process(const In &in) {
    uint8_t byte = uint8_t(in.u);
    byte <<= in.by;
    state().out[in.serial & 63] = {
        in.u << in.by, in.u >> in.by, in.i << in.by,
        in.i >> in.by, in.l << in.by, in.l >> in.by,
        in.v >> in.u,  byte,          glm::ivec2(in.i, in.by) << in.by};
  }
};
struct Shifts : piko::Pipe<State> {
  Variable variable;
  Shifts() { source(variable); }
};

#pragma clang diagnostic ignored "-Wshift-count-overflow"
#pragma clang diagnostic ignored "-Wshift-count-negative"
struct Known : piko::Stage<0, 0, 64, In>, piko::Uses<State> {
  void process(const In &in) {
    state().out[in.serial & 63] = {in.u << 32, in.u >> 33, in.i << -1,
                                   in.i >> 63, in.l << 64, in.l >> 100,
                                   in.v >> 65, in.i >> 37, glm::ivec2(0)};
  }
};
struct Fixed : piko::Pipe<State> {
  Known known;
  Fixed() { source(known); }
};

struct Pixels {
  piko::Image<uint32_t> image;
};
struct Draw : piko::Stage<8, 8, 64, In>, piko::Uses<Pixels> {
  void assignBin(const In &in) { assignToAll(in); }
  void process(const In &in) {
    parallelForPixels([&](glm::ivec2 at) {
      uint32_t bits = in.u >> (at.x * 9 - at.y * 40);
      this->update(state().image, at,
                   [&](uint32_t &p) { p = (p << (at.x + in.by)) ^ bits; });
    });
  }
};
struct Lanes : piko::Pipe<Pixels> {
  Draw draw;
  Lanes() { source(draw); }
};

// What the language says, by other means: the amount modulo 32.
struct Compare : piko::Stage<0, 0, 64, In>, piko::Uses<State> {
  static uint32_t doubled(uint32_t value, int times) {
    for (int i = 0; i < times; ++i)
      value *= 2;
    return value;
  }
  void process(const In &in) {
    uint32_t value = in.u | 1;
    bool same = true;
    for (int by = -70; by < 70; ++by)
      same &= value << by == doubled(value, by & 31);
    if (!same)
      state().out[-1].left = 1; // an error
    state().results[0] = 1;
  }
};
struct Values : piko::Pipe<State> {
  Compare compare;
  Values() { source(compare); }
};
