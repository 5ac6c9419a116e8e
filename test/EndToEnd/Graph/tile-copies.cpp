// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where rows of an image are a multiple of 4096 bytes apart, bins with many
// primitives are drawn in copies of their pixels, on what another stage has left
// there: with bins at the edges of the domain that are cut, and with such that
// have few primitives. What is in the images is the reference executor's.
// RUN: pikoc %s --pipe Keys,Blends,WidePipe --emit=target --cpu x86-64-v3 -o - | FileCheck %s --check-prefix=COPIES
// COPIES: llvm.call @pikoir_open_tile
// COPIES: llvm.call @pikoir_close_tile
// COPIES: {{^}}// -----
// COPIES: llvm.call @pikoir_open_tile
// COPIES: {{^}}// -----
// COPIES: llvm.call @pikoir_open_tile
//
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Keys --domain 512 100 --count 900
// CASE: --pipe Keys --domain 520 100 --count 900
// CASE: --pipe Keys --domain 1024 40 --count 300
// CASE: --pipe Blends --domain 1024 70 --count 1500
// CASE: --pipe Blends --domain 1024 70 --count 40
// CASE: --pipe WidePipe --domain 256 90 --count 700
#include <piko.h>

struct Box {
  int32_t x, y;
  uint16_t w, h;
  uint32_t key;
};
struct Key {
  uint64_t key = 0;
};
struct Gray {
  float value = 0.5f;
};
struct Wide { // 16 bytes, of which a primitive changes some
  int32_t count = 3;
  float sum = 0;
  uint16_t last[4] = {1, 2, 3, 4};
};
struct State {
  piko::Image<Key> keys;
  piko::Image<Gray> gray;
  piko::Image<Wide> wide;
};

inline glm::ivec2 firstOf(const Box &b, glm::ivec2 size) {
  return glm::ivec2(uint32_t(b.x) % uint32_t(size.x),
                    uint32_t(b.y) % uint32_t(size.y));
}
inline glm::ivec2 lastOf(const Box &b, glm::ivec2 size) {
  return firstOf(b, size) + glm::ivec2(b.w % 90, b.h % 60);
}

template <class Self, int Bin>
struct Draw : piko::Stage<Bin, Bin, 64, Box>, piko::Uses<State> {
  void assignBin(const Box &b) {
    this->assignToBoundingBox(b, firstOf(b, this->domain()),
                              lastOf(b, this->domain()));
  }
  void process(const Box &b) {
    this->parallelForPixels(
        firstOf(b, this->domain()), lastOf(b, this->domain()),
        [&](glm::ivec2 p) { static_cast<Self *>(this)->draw(b, p); });
  }
};

// What is in the image before is a point's, from another kernel.
struct Points : piko::Stage<0, 0, 64, Box, Box>, piko::Uses<State> {
  void process(const Box &b) {
    piko::atomicMax(state().keys(firstOf(b, domain())).key,
                    uint64_t(b.key) * 7919);
    emit(b);
  }
};
struct DrawKeys : Draw<DrawKeys, 64> {
  void schedule(piko::BinId) { endStage<Points>(); }
  void draw(const Box &b, glm::ivec2 p) {
    uint64_t key = uint64_t(b.key) * uint32_t(p.x + 3 * p.y);
    update(state().keys, p, [&](Key &k) { k.key = glm::max(k.key, key); });
  }
};
struct Keys : piko::Pipe<State> {
  Points points;
  DrawKeys draw;
  Keys() {
    source(points);
    connect(points, 0, draw);
  }
};

// What is in the image before is another stage's, with bins of its own.
template <class Second>
struct First : piko::Stage<16, 16, 64, Box, Box>, piko::Uses<State> {
  void assignBin(const Box &b) {
    assignToBin(b, binFromPosition(firstOf(b, domain())));
  }
  void process(const Box &b) {
    Second::change(*this, b, firstOf(b, domain()));
    emit(b);
  }
};
template <class Self> struct Again : Draw<Self, 32> {
  void schedule(piko::BinId) { this->template endStage<First<Self>>(); }
  void draw(const Box &b, glm::ivec2 p) { Self::change(*this, b, p); }
};
template <class Second> struct Twice : piko::Pipe<State> {
  First<Second> first;
  Second second;
  Twice() {
    this->source(first);
    this->connect(first, 0, second);
  }
};

struct Blend : Again<Blend> {
  template <class Stage>
  static void change(Stage &stage, const Box &b, glm::ivec2 p) {
    float value = float(b.key & 255) * (1 / 255.0f);
    stage.update(stage.state().gray, p,
                 [&](Gray &g) { g.value = g.value * 0.75f + value * 0.25f; });
  }
};
struct Blends : Twice<Blend> {};

struct DrawWide : Again<DrawWide> {
  template <class Stage>
  static void change(Stage &stage, const Box &b, glm::ivec2 p) {
    stage.update(stage.state().wide, p, [&](Wide &w) {
      w.last[w.count++ & 3] = uint16_t(b.key);
      w.sum += float(b.key % 1000);
    });
  }
};
struct WidePipe : Twice<DrawWide> {};
