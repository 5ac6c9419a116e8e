// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Depth and colour of pixels that many sheets cover, on several threads.
// `Apart` finds by an atomic where a sheet is nearest as yet, shades it and
// stores its colour there: meanwhile another one may have come nearer, and its
// colour is overwritten. `Together` changes both in one update.
#include <piko.h>

#include <bit>

struct Sheet {
  float depth;
  int effort; // of its shader: steps of an iteration
};
struct Painted {
  float depth, color;
};
struct Nearest {
  float depth = 1e30f, color = 0;
};
struct State {
  piko::Image<Nearest> together;
  piko::Buffer<uint32_t> depths; // bits of floats, which are in order
  piko::Buffer<float> colors;
};

// Near to its sheet's depth, by which it can be told.
inline float shade(const Sheet &s) {
  float x = s.depth;
  for (int i = 0; i < s.effort; ++i)
    x = piko::sqrt(x * 0.5f + 0.5f);
  return s.depth * x;
}

struct Apart : piko::Stage<0, 0, 64, Sheet>, piko::Uses<State> {
  void schedule(piko::BinId) {
    specifyOrder(piko::Unordered);
    specifySchedule(piko::All, 1);
  }
  void process(const Sheet &s) {
    uint32_t depth = std::bit_cast<uint32_t>(s.depth);
    bool passed[256];
    for (int i = 0; i < 256; ++i)
      passed[i] = depth < piko::atomicMinFetch(state().depths[i], depth);
    float color = shade(s);
    for (int i = 0; i < 256; ++i)
      if (passed[i])
        state().colors[i] = color;
  }
};

struct Shade : piko::Stage<0, 0, 64, Sheet, Painted>, piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::All, 1); }
  void process(const Sheet &s) { emit(Painted{s.depth, shade(s)}); }
};

struct Together : piko::Stage<8, 8, 64, Painted>, piko::Uses<State> {
  void assignBin(const Painted &p) { assignToAll(p); }
  void process(const Painted &p) {
    parallelForPixels([&](glm::ivec2 at) {
      update(state().together, at, [&](Nearest &nearest) {
        if (p.depth < nearest.depth)
          nearest = {p.depth, p.color};
      });
    });
  }
};

struct ColorsApart : piko::Pipe<State> {
  Apart apart;
  ColorsApart() { source(apart); }
};
struct ColorsTogether : piko::Pipe<State> {
  Shade shade;
  Together together;
  ColorsTogether() {
    source(shade);
    connect(shade, 0, together);
  }
};
