// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/raster's Tiled with depths of other formats, all from -1 to 0 or 1.
// Less is nearer.
#include "raster/raster.piko.cpp"

namespace raster {

/// z / w in an integer of so many bits.
template <int Bits> struct IntegerDepth {
  static float of(const Fragment &f, const Camera &) {
    constexpr float count = float(1 << Bits); // floats hold all of them
    float number = glm::floor((f.depth * 0.5f + 0.5f) * (count - 1) + 0.5f);
    return number / count - 1;
  }
};

struct FloatDepth {
  static float of(const Fragment &f, const Camera &) { return f.depth; }
};

/// Reversed: 0 at infinity, where floats are dense, as places far away are in
/// what the projection makes of them.
struct ReversedDepth {
  static float of(const Fragment &f, const Camera &c) {
    return -c.nearZ / glm::dot(f.position - c.eye, c.forward);
  }
};

template <Mapping M, class Format> struct DepthShader : FragmentShader<M> {
  void process(const Fragment &f) {
    const auto &state = this->state();
    glm::vec3 n = glm::normalize(f.normal);
    glm::vec3 sum(state.settings.ambient);
    for (int64_t i = 0; i < state.lights.size(); ++i)
      sum += irradiance(state.lights[i], f.position, n);
    this->emit(ShadedFragment{f.pixel, Format::of(f, state.camera),
                              state.settings.albedo * sum},
               0);
  }
};

constexpr Mapping tiled = {.bin = 32, .apart = false, .waits = true};
template <class Format>
struct DepthRaster : IndexedRaster<tiled, DepthShader<tiled, Format>> {};

} // namespace raster

struct Depth16 : raster::DepthRaster<raster::IntegerDepth<16>> {};
struct Depth24 : raster::DepthRaster<raster::IntegerDepth<24>> {};
struct DepthFloat : raster::DepthRaster<raster::FloatDepth> {};
struct DepthReversed : raster::DepthRaster<raster::ReversedDepth> {};
