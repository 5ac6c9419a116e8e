// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/oit, and cheaper ways to compose a pixel's layers: the k nearest of
// them, and weighted blended transparency, which needs no order.
#include "oit/oit.piko.cpp"

namespace oit {

//===----------------------------------------------------------------------===//
// The k nearest
//===----------------------------------------------------------------------===//

template <int K> struct Nearest {
  int32_t count = 0;
  float depth[K] = {};
  glm::vec4 rgba[K] = {};
};

template <int K> struct NearestState : State {
  piko::Image<Nearest<K>> nearest;
};

// Insertion by depth; what comes first is before its equals.
template <Mapping M, int K>
struct Keep : piko::Stage<M.bin, M.bin, 64, Layer>,
              piko::Uses<NearestState<K>> {
  void assignBin(const Layer &l) {
    this->assignToBin(l, this->binFromPosition(l.pixel));
  }

  void process(const Layer &l) {
    this->update(this->state().nearest, l.pixel, [&](Nearest<K> &kept) {
      float depth = l.depth;
      glm::vec4 rgba = l.rgba;
      for (int i = 0; i < kept.count; ++i)
        if (depth < kept.depth[i]) {
          std::swap(depth, kept.depth[i]);
          std::swap(rgba, kept.rgba[i]);
        }
      if (kept.count < K) {
        kept.depth[kept.count] = depth;
        kept.rgba[kept.count++] = rgba;
      }
    });
  }
};

template <Mapping M, int K>
struct Compose : piko::Stage<M.bin, M.bin, 64, Nothing>,
                 piko::Uses<NearestState<K>> {
  void assignBin(const Nothing &n) { this->assignToAll(n); }
  void schedule(piko::BinId) {
    this->everyBin();
    this->template endStage<Keep<M, K>>();
  }

  void process(const piko::List<Nothing> &) {
    this->parallelForPixels([&](glm::ivec2 p) {
      const Nearest<K> &kept = this->state().nearest(p);
      this->update(this->state().color, p, [&](Color &c) {
        for (int i = kept.count - 1; i >= 0; --i)
          c.rgba = kept.rgba[i] + (1 - kept.rgba[i].a) * c.rgba;
      });
    });
  }
};

//===----------------------------------------------------------------------===//
// Weighted blended (McGuire and Bavoil, JCGT 2(2), 2013; their equation 10)
//===----------------------------------------------------------------------===//

struct Sums {
  glm::vec4 weighted = glm::vec4(0);
  float through = 1; // of the light after all layers
};

struct WeightedState : State {
  piko::Image<Sums> sums;
};

template <Mapping M>
struct Weigh : piko::Stage<M.bin, M.bin, 64, Layer>, piko::Uses<WeightedState> {
  void assignBin(const Layer &l) {
    this->assignToBin(l, this->binFromPosition(l.pixel));
  }

  void process(const Layer &l) {
    float near = 0.5f - 0.5f * l.depth;
    float weight = glm::max(0.01f, 3000 * near * near * near);
    this->update(this->state().sums, l.pixel, [&](Sums &sums) {
      sums.weighted += l.rgba * weight;
      sums.through *= 1 - l.rgba.a;
    });
  }
};

template <Mapping M>
struct Average : piko::Stage<M.bin, M.bin, 64, Nothing>,
                 piko::Uses<WeightedState> {
  void assignBin(const Nothing &n) { this->assignToAll(n); }
  void schedule(piko::BinId) {
    this->everyBin();
    this->template endStage<Weigh<M>>();
  }

  void process(const piko::List<Nothing> &) {
    this->parallelForPixels([&](glm::ivec2 p) {
      const Sums &sums = this->state().sums(p);
      if (!(sums.weighted.a > 0))
        return;
      glm::vec3 mean = glm::vec3(sums.weighted) / sums.weighted.a;
      this->update(this->state().color, p, [&](Color &c) {
        glm::vec3 after(c.rgba);
        c.rgba = glm::vec4(mean * (1 - sums.through) + after * sums.through, 1);
      });
    });
  }
};

template <Mapping M, class UsedState, class Gather, class Resolve>
struct Approximate : piko::Pipe<UsedState> {
  VertexShader vertexShader;
  Rasterizer<M> rasterizer;
  FragmentShader<M> fragmentShader;
  Gather gather;
  Resolve resolve;

  Approximate() {
    this->source(vertexShader);
    this->source(rasterizer);
    this->source(resolve);
    this->connect(rasterizer, 0, fragmentShader);
    this->connect(fragmentShader, 0, gather);
    this->allocateForSource(this->state().vertices, 0);
  }
};

constexpr Mapping bins16 = {.bin = 16, .apart = false};
template <int K>
struct KNearest : Approximate<bins16, NearestState<K>, Keep<bins16, K>,
                              Compose<bins16, K>> {};

struct Sorted : Oit<bins16> {};
struct Nearest2 : KNearest<2> {};
struct Nearest4 : KNearest<4> {};
struct Nearest8 : KNearest<8> {};
struct Nearest16 : KNearest<16> {};
struct Nearest32 : KNearest<32> {};
struct Weighted
    : Approximate<bins16, WeightedState, Weigh<bins16>, Average<bins16>> {};

} // namespace oit
