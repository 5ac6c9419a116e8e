// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Transparent layers. `FirstLayers` keeps as many of a pixel as an array holds;
// `BitonicLayers` sorts such an array by a network, which is not stable;
// `ByteLayers` blends into eight bits a channel. `SortedLayers` is the
// example's.
#include "oit/oit.piko.cpp"

namespace layers {

using oit::Layer;
using oit::Mapping;

constexpr Mapping bins{.bin = 16, .apart = false};

/// The layers of a pixel that were kept.
template <int K> struct Kept {
  int count = 0;
  float depth[K];
  glm::vec4 rgba[K];
};
template <int K> struct KeptState {
  piko::Image<Kept<K>> kept;
  piko::Image<piko::scene::Color> color;
};

template <int K>
struct Keep : piko::Stage<16, 16, 64, Layer>, piko::Uses<KeptState<K>> {
  void assignBin(const Layer &l) {
    this->assignToBin(l, this->binFromPosition(l.pixel));
  }
  void process(const Layer &l) {
    this->update(this->state().kept, l.pixel, [&](Kept<K> &kept) {
      if (kept.count == K)
        return;
      kept.depth[kept.count] = l.depth;
      kept.rgba[kept.count] = l.rgba;
      ++kept.count;
    });
  }
};

// Sorts each pixel's layers, the farthest first, and blends them.
template <int K>
struct Resolve : piko::Stage<16, 16, 64, piko::scene::Nothing>,
                 piko::Uses<KeptState<K>> {
  void assignBin(const piko::scene::Nothing &n) { this->assignToAll(n); }
  void schedule(piko::BinId) {
    this->everyBin();
    this->template endStage<Keep<K>>();
  }
  void process(const piko::List<piko::scene::Nothing> &) {
    this->parallelForPixels([&](glm::ivec2 p) {
      const Kept<K> &kept = this->state().kept(p);
      int32_t order[K];
      for (int i = 0; i < K; ++i)
        order[i] = i;
      auto depth = [&](int i) {
        return order[i] < kept.count ? kept.depth[order[i]] : INFINITY;
      };
      for (int run = 2; run <= K; run *= 2) // Batcher 1968
        for (int apart = run / 2; apart > 0; apart /= 2)
          for (int i = 0; i < K; ++i) {
            int j = i ^ apart;
            bool isTurned = (i & run) != 0;
            if (i < j && (isTurned ? depth(i) > depth(j) : depth(i) < depth(j)))
              std::swap(order[i], order[j]);
          }
      glm::vec4 color = piko::scene::Color().rgba;
      for (int i = 0; i < K; ++i)
        if (order[i] < kept.count)
          color = kept.rgba[order[i]] + (1 - kept.rgba[order[i]].a) * color;
      this->state().color.store(p, {color});
    });
  }
};

template <int K> struct KBuffer : piko::Pipe<KeptState<K>> {
  Keep<K> blend;
  Resolve<K> resolve;
  KBuffer() {
    this->source(blend);
    this->source(resolve);
  }
};

struct ByteState {
  piko::Image<piko::scene::Color8> color;
};

// As the example's, but for what a pixel holds.
struct ByteBlend : piko::Stage<16, 16, 64, Layer>, piko::Uses<ByteState> {
  void assignBin(const Layer &l) { assignToBin(l, binFromPosition(l.pixel)); }
  void schedule(piko::BinId) { endBin(); }
  void process(const piko::List<Layer> &layers) {
    int last = int(layers.size()) - 1;
    parallelFor(last + 1, [&](int i) {
      int rank = sort(-layers[last - i].depth);
      const Layer &l = layers[last - rank];
      update(state().color, l.pixel, [&](piko::scene::Color8 &behind) {
        glm::vec4 color{behind.rgba & 255, behind.rgba >> 8 & 255,
                        behind.rgba >> 16 & 255, behind.rgba >> 24};
        behind =
            piko::scene::toColor8(l.rgba + (1 - l.rgba.a) * color / 255.0f);
      });
    });
  }
};

} // namespace layers

struct FirstLayers : layers::KBuffer<8> {};
struct BitonicLayers : layers::KBuffer<64> {};
struct ByteLayers : piko::Pipe<layers::ByteState> {
  layers::ByteBlend blend;
  ByteLayers() { source(blend); }
};
struct SortedLayers : piko::Pipe<oit::State> {
  oit::Blend<layers::bins> blend;
  SortedLayers() { source(blend); }
};
