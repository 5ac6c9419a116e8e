// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Sheets at the same depth, of which the first is to be seen, whichever thread
// comes first. `Prepass` finds the least depth, and then each sheet that has it
// stores its number; `Keyed` finds the greatest key, which has the depth above
// and the number below.
#include <piko.h>

#include <bit>

struct Sheet {
  glm::ivec2 lo, hi; // pixels, both included
  float depth;       // above 0
  int index;
};
struct State {
  piko::Image<uint32_t> depth; // the bits of 1 / depth, which are in order
  piko::Image<int> shown;
  piko::Image<uint64_t> keys;
};

inline uint32_t nearness(const Sheet &s) {
  return std::bit_cast<uint32_t>(1 / s.depth);
}

template <class F> void forPixels(const Sheet &s, F f) {
  for (int y = s.lo.y; y <= s.hi.y; ++y)
    for (int x = s.lo.x; x <= s.hi.x; ++x)
      f(glm::ivec2(x, y));
}

struct FindDepth : piko::Stage<0, 0, 64, Sheet>, piko::Uses<State> {
  void process(const Sheet &s) {
    forPixels(s, [&](glm::ivec2 p) {
      piko::atomicMax(state().depth(p), nearness(s));
    });
  }
};

struct StoreEqual : piko::Stage<0, 0, 64, Sheet>, piko::Uses<State> {
  void schedule(piko::BinId) { endStage<FindDepth>(); }
  void process(const Sheet &s) {
    forPixels(s, [&](glm::ivec2 p) {
      if (state().depth(p) == nearness(s))
        state().shown.store(p, s.index + 1);
    });
  }
};

struct FindKey : piko::Stage<0, 0, 64, Sheet>, piko::Uses<State> {
  void process(const Sheet &s) {
    uint64_t key = uint64_t(nearness(s)) << 32 | ~uint32_t(s.index);
    forPixels(s, [&](glm::ivec2 p) { piko::atomicMax(state().keys(p), key); });
  }
};

struct PrepassSheets : piko::Pipe<State> {
  FindDepth findDepth;
  StoreEqual storeEqual;
  PrepassSheets() {
    source(findDepth);
    source(storeEqual);
  }
};
struct KeyedSheets : piko::Pipe<State> {
  FindKey findKey;
  KeyedSheets() { source(findKey); }
};
