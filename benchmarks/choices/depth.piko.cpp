// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/raster's Tiled with depths of other formats and another near plane:
// `range` times nearer than the far plane. Less is nearer.
#include "raster/raster.piko.cpp"

namespace raster {

struct RangeState : IndexedState {
  float range = 10; ///< of distances; the camera's, if that is more
};

/// What the near plane makes of depths: z / w, from 0 to 1, is a linear
/// function of z / w of any other near plane.
template <class Float> struct Range {
  Float scale, shift;

  explicit Range(const RangeState &state) {
    Float n = state.camera.nearZ, f = state.camera.farZ;
    Float range = glm::max(Float(state.range), f / n);
    scale = (f - n) / (2 * n * (range - 1));
    shift = (range - (f + n) / (2 * n)) / (range - 1);
  }

  /// `z` is of the camera's planes, from -1 to 1.
  Float of(float z) const { return shift + scale * Float(z); }
};

/// z / w in an integer of so many bits. Floats hold all values of 24.
template <int Bits> struct IntegerDepth {
  using Number = std::conditional_t<Bits <= 16, uint16_t, uint32_t>;
  using Float = std::conditional_t<Bits <= 24, float, double>;
  static constexpr Number far = Number((uint64_t(1) << Bits) - 1);

  static Number of(const Fragment &f, const RangeState &state) {
    Float z = glm::clamp(Range<Float>(state).of(f.depth), Float(0), Float(1));
    return Number(z * Float(far) + Float(0.5));
  }
};

struct FloatDepth {
  using Number = float;
  static constexpr float far = 1;

  static float of(const Fragment &f, const RangeState &state) {
    return Range<float>(state).of(f.depth);
  }
};

/// Reversed: 0 at infinity, where floats are dense, as places far away are in
/// what the projection makes of them.
struct ReversedDepth {
  using Number = float;
  static constexpr float far = 0;

  static float of(const Fragment &f, const RangeState &state) {
    const Camera &c = state.camera;
    float nearZ = glm::min(c.nearZ, c.farZ / state.range);
    return -nearZ / glm::dot(f.position - c.eye, c.forward);
  }
};

template <class Format> struct FormatFragment {
  glm::ivec2 pixel;
  typename Format::Number depth;
  glm::vec3 color;
};

template <class Format> struct FormatPixel {
  typename Format::Number z = Format::far;
};

template <class Format> struct FormatState : RangeState {
  piko::Image<FormatPixel<Format>> nearest;
};

template <Mapping M, class Format>
struct FormatShader
    : piko::Stage<M.bin, M.bin, 64, Fragment, FormatFragment<Format>>,
      piko::Uses<RangeState> {
  void assignBin(const Fragment &f) { this->assignToPreviousBins(f); }
  void schedule(piko::BinId) { this->endBin(); }

  void process(const Fragment &f) {
    glm::vec3 n = glm::normalize(f.normal);
    glm::vec3 sum(this->state().settings.ambient);
    for (int64_t i = 0; i < this->state().lights.size(); ++i)
      sum += irradiance(this->state().lights[i], f.position, n);
    this->emit({f.pixel, Format::of(f, this->state()),
                this->state().settings.albedo * sum});
  }
};

template <Mapping M, class Format>
struct FormatTest
    : piko::Stage<M.bin, M.bin, 64, FormatFragment<Format>, PixelColor>,
      piko::Uses<FormatState<Format>> {
  void assignBin(const FormatFragment<Format> &f) {
    this->assignToPreviousBins(f);
  }

  void process(const FormatFragment<Format> &f) {
    bool passed = this->update(this->state().nearest, f.pixel,
                               [&](FormatPixel<Format> &nearest) {
                                 bool isNearer = f.depth < nearest.z;
                                 if (isNearer)
                                   nearest.z = f.depth;
                                 return isNearer;
                               });
    if (passed)
      this->emit(PixelColor{f.pixel, f.color});
  }
};

template <Mapping M, class Format>
struct DepthRaster : piko::Pipe<FormatState<Format>> {
  FormatShader<M, Format> fragmentShader;
  FormatTest<M, Format> depthTest;
  Composite<M> composite;
  VertexShader vertexShader;
  Setup setup;
  Rasterizer<M, BoxedTriangle, IndexedState> rasterizer;

  DepthRaster() {
    this->source(vertexShader);
    this->source(setup);
    this->connect(setup, 0, rasterizer);
    this->connect(rasterizer, 0, fragmentShader);
    this->connect(fragmentShader, 0, depthTest);
    this->connect(depthTest, 0, composite);
    this->allocateForSource(this->state().vertices, 0);
  }
};

constexpr Mapping tiled = {.bin = 32, .apart = false, .waits = true};

} // namespace raster

template <class Format>
struct WithDepth : raster::DepthRaster<raster::tiled, Format> {};
struct Depth16 : WithDepth<raster::IntegerDepth<16>> {};
struct Depth24 : WithDepth<raster::IntegerDepth<24>> {};
struct Depth32 : WithDepth<raster::IntegerDepth<32>> {};
struct DepthFloat : WithDepth<raster::FloatDepth> {};
struct DepthReversed : WithDepth<raster::ReversedDepth> {};
