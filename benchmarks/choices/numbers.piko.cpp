// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/raster's Tiled, shaded by numbers of three kinds, and in double.
#include "raster/raster.piko.cpp"

namespace raster {

constexpr Mapping tiled(piko::Precision precision) {
  return {.bin = 32, .apart = false, .waits = true, .precision = precision};
}

template <Mapping M> struct DoubleShader : FragmentShader<M> {
  void process(const Fragment &f) {
    glm::dvec3 n = glm::normalize(glm::dvec3(f.normal));
    glm::dvec3 sum(this->state().settings.ambient);
    for (int64_t i = 0; i < this->state().lights.size(); ++i) {
      const Light &light = this->state().lights[i];
      glm::dvec3 l = glm::dvec3(light.position) -
                     double(light.position.w) * glm::dvec3(f.position);
      double facing = glm::max(0.0, glm::dot(n, l));
      sum += glm::dvec3(light.color) * (facing / glm::sqrt(glm::dot(l, l)));
    }
    this->emit(ShadedFragment{f.pixel, f.depth,
                              this->state().settings.albedo * glm::vec3(sum)},
               0);
  }
};

} // namespace raster

template <piko::Precision P>
struct Numbers : raster::IndexedRaster<raster::tiled(P)> {};
struct StrictNumbers : Numbers<piko::Precision::Strict> {};
struct ContractedNumbers : Numbers<piko::Precision::Contracted> {};
struct RelaxedNumbers : Numbers<piko::Precision::Relaxed> {};

constexpr raster::Mapping strictly = raster::tiled(piko::Precision::Strict);
struct DoubleNumbers
    : raster::IndexedRaster<strictly, raster::DoubleShader<strictly>> {};
