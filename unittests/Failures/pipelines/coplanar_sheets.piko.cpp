// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Sheets in the same plane, but of other triangles. `TolerantOit` keeps the
// order of drawing for depths that differ by no more than rounding explains.
#include "oit/oit.piko.cpp"

namespace tolerant {

using namespace oit;

constexpr Mapping bins{.bin = 16, .apart = false};
constexpr int capacity = 16;
/// A corner is up to 1/512 pixel away from where its depth is that of the
/// plane. This is enough for slopes of up to 1/128 a pixel.
constexpr float tolerance = 0x1p-15f;

/// The layers of a pixel, from front to back.
struct Kept {
  int count = 0;
  float depth[capacity];
  glm::vec4 rgba[capacity];
};
struct KeptState : State {
  piko::Image<Kept> kept;
};

// Inserts a layer behind those at its depth.
struct Keep : piko::Stage<16, 16, 64, Layer>, piko::Uses<KeptState> {
  void assignBin(const Layer &l) { assignToPreviousBins(l); }
  void process(const Layer &l) {
    update(state().kept, l.pixel, [&](Kept &kept) {
      int at = piko::min(kept.count, capacity - 1);
      for (; at > 0 && kept.depth[at - 1] > l.depth + tolerance; --at) {
        kept.depth[at] = kept.depth[at - 1];
        kept.rgba[at] = kept.rgba[at - 1];
      }
      kept.depth[at] = l.depth;
      kept.rgba[at] = l.rgba;
      kept.count = piko::min(kept.count + 1, capacity);
    });
  }
};

struct Resolve : piko::Stage<16, 16, 64, Nothing>, piko::Uses<KeptState> {
  void assignBin(const Nothing &n) { assignToAll(n); }
  void schedule(piko::BinId) {
    everyBin();
    endStage<Keep>();
  }
  void process(const piko::List<Nothing> &) {
    parallelForPixels([&](glm::ivec2 p) {
      const Kept &kept = state().kept(p);
      Color color;
      for (int i = kept.count - 1; i >= 0; --i)
        color.rgba = kept.rgba[i] + (1 - kept.rgba[i].a) * color.rgba;
      state().color.store(p, color);
    });
  }
};

} // namespace tolerant

struct TolerantOit : piko::Pipe<tolerant::KeptState> {
  oit::VertexShader vertexShader;
  oit::Rasterizer<tolerant::bins> rasterizer;
  oit::FragmentShader<tolerant::bins> fragmentShader;
  tolerant::Keep keep;
  tolerant::Resolve resolve;

  TolerantOit() {
    source(vertexShader);
    source(rasterizer);
    source(resolve);
    connect(rasterizer, 0, fragmentShader);
    connect(fragmentShader, 0, keep);
    allocateForSource(state().vertices, 0);
  }
};
