// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/raster's Tiled with normals, colours or both in halves on the edges
// between its stages. All is computed in floats.
#include "raster/raster.piko.cpp"

#include <bit>

namespace raster {

/// A vector of halves, as integers: a primitive has no halves.
struct HalfVector {
  uint16_t x, y, z;

  HalfVector() = default;
  HalfVector(glm::vec3 v) : x(bits(v.x)), y(bits(v.y)), z(bits(v.z)) {}
  operator glm::vec3() const { return {value(x), value(y), value(z)}; }

private:
  static uint16_t bits(float number) {
    return std::bit_cast<uint16_t>(static_cast<_Float16>(number));
  }
  static float value(uint16_t bits) {
    return static_cast<float>(std::bit_cast<_Float16>(bits));
  }
};

template <class Normal> struct FragmentOf {
  glm::ivec2 pixel;
  float depth;
  glm::vec3 position;
  Normal normal;
};

template <class Color> struct ShadedOf {
  glm::ivec2 pixel;
  float depth;
  Color color;
};

template <class Color> struct PixelOf {
  glm::ivec2 pixel;
  Color color;
};

template <Mapping M, class Normal, class Color>
struct EdgeShader
    : piko::Stage<M.bin, M.bin, 64, FragmentOf<Normal>, ShadedOf<Color>>,
      piko::Uses<State> {
  void assignBin(const FragmentOf<Normal> &f) { this->assignToPreviousBins(f); }
  void schedule(piko::BinId) { this->endBin(); }

  void process(const FragmentOf<Normal> &f) {
    glm::vec3 n = glm::normalize(glm::vec3(f.normal));
    glm::vec3 sum(this->state().settings.ambient);
    for (int64_t i = 0; i < this->state().lights.size(); ++i)
      sum += irradiance(this->state().lights[i], f.position, n);
    this->emit({f.pixel, f.depth, this->state().settings.albedo * sum});
  }
};

template <Mapping M, class Color>
struct EdgeTest
    : piko::Stage<M.bin, M.bin, 64, ShadedOf<Color>, PixelOf<Color>>,
      piko::Uses<State> {
  void assignBin(const ShadedOf<Color> &f) { this->assignToPreviousBins(f); }

  void process(const ShadedOf<Color> &f) {
    bool passed =
        this->update(this->state().depth, f.pixel, [&](Depth &nearest) {
          bool isNearer = f.depth < nearest.z;
          if (isNearer)
            nearest.z = f.depth;
          return isNearer;
        });
    if (passed)
      this->emit({f.pixel, f.color});
  }
};

template <Mapping M, class EdgeColor>
struct EdgeComposite : piko::Stage<M.bin, M.bin, 64, PixelOf<EdgeColor>>,
                       piko::Uses<State> {
  void assignBin(const PixelOf<EdgeColor> &p) { this->assignToPreviousBins(p); }

  void process(const PixelOf<EdgeColor> &p) {
    this->update(this->state().color, p.pixel, [&](piko::scene::Color &c) {
      c.rgba = glm::vec4(glm::vec3(p.color), 1);
    });
  }
};

template <Mapping M, class Normal, class Color>
struct EdgeRaster : piko::Pipe<IndexedState> {
  EdgeShader<M, Normal, Color> fragmentShader;
  EdgeTest<M, Color> depthTest;
  EdgeComposite<M, Color> composite;
  VertexShader vertexShader;
  Setup setup;
  Rasterizer<M, BoxedTriangle, IndexedState, FragmentOf<Normal>> rasterizer;

  EdgeRaster() {
    source(vertexShader);
    source(setup);
    connect(setup, 0, rasterizer);
    connect(rasterizer, 0, fragmentShader);
    connect(fragmentShader, 0, depthTest);
    connect(depthTest, 0, composite);
    allocateForSource(state().vertices, 0);
  }
};

} // namespace raster

template <class Normal, class Color>
struct Edged : raster::EdgeRaster<{.bin = 32, .apart = false, .waits = true},
                                  Normal, Color> {};
struct HalfNormals : Edged<raster::HalfVector, glm::vec3> {};
struct HalfColors : Edged<glm::vec3, raster::HalfVector> {};
struct Halves : Edged<raster::HalfVector, raster::HalfVector> {};
