// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Hundreds of layers at a pixel, many of them at equal depths, transparent and
// opaque ones among them, are blended with the reference executor's bits.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s
// CASE: --pipe Small --domain 9 3 --count 8000
// CASE: --pipe Shared --domain 3 2 --count 3000 --wide
// CASE: --pipe OneDepth --domain 2 2 --count 10000
#include "../../../examples/oit/oit.piko.cpp"

struct Random {
  uint32_t x, y, depth, alpha;
  glm::vec3 color;
  float anyDepth; // also NaN and infinities
};

template <bool Equal>
struct MakeLayers : piko::Stage<0, 0, 64, Random, oit::Layer> {
  void process(const Random &r) {
    glm::ivec2 pixel(r.x % uint32_t(this->domain().x),
                     r.y % uint32_t(this->domain().y));
    float alpha = r.alpha % 8 == 0   ? 0.0f
                  : r.alpha % 8 == 1 ? 1.0f
                                     : float(r.alpha % 64) / 64;
    float depth = Equal              ? 0.5f
                  : r.depth % 4 == 0 ? r.anyDepth
                                     : float(r.depth % 16);
    this->emit({pixel, depth, glm::vec4(r.color * alpha, alpha)});
  }
};

template <int Bin, bool Equal = false> struct Layers : piko::Pipe<oit::State> {
  MakeLayers<Equal> makeLayers;
  oit::Blend<{.bin = Bin, .apart = false}> blend;
  Layers() {
    source(makeLayers);
    connect(makeLayers, 0, blend);
  }
};

struct Small : Layers<8> {};
struct Shared : Layers<0> {};
struct OneDepth : Layers<8, true> {};
