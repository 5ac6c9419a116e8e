// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/raster's Tiled with highlights, fog and a display's gamma, whose
// functions are as exact as the stage that shades says.
#include "raster/raster.piko.cpp"

namespace raster {

template <Mapping M, int Ulps> struct FunctionShader : FragmentShader<M> {
  void schedule(piko::BinId) {
    this->endBin();
    this->specifyPrecision(M.precision);
    if constexpr (Ulps > 0)
      this->specifyUlps(Ulps);
  }

  /// Blinn's (1977), towards an eye from which positions are counted.
  void process(const Fragment &f) {
    constexpr float shininess = 40, density = 0.02f, gamma = 1 / 2.2f;
    glm::vec3 n = glm::normalize(f.normal),
              toEye = glm::normalize(this->state().camera.eye - f.position);
    glm::vec3 sum(this->state().settings.ambient);
    for (int64_t i = 0; i < this->state().lights.size(); ++i) {
      const Light &light = this->state().lights[i];
      glm::vec3 l = glm::normalize(glm::vec3(light.position) -
                                   light.position.w * f.position);
      float facing = piko::max(glm::dot(n, l), 0.0f),
            half = piko::max(glm::dot(n, glm::normalize(l + toEye)), 0.0f);
      sum +=
          glm::vec3(light.color) * (facing + 0.5f * piko::pow(half, shininess));
    }
    glm::vec3 color = this->state().settings.albedo * sum;
    color *= piko::exp(-density *
                       glm::distance(this->state().camera.eye, f.position));
    for (int i = 0; i < 3; ++i)
      color[i] = piko::pow(color[i], gamma);
    this->emit(ShadedFragment{f.pixel, f.depth, color}, 0);
  }
};

constexpr Mapping shadedBy(piko::Precision precision) {
  return {.bin = 32, .apart = false, .waits = true, .precision = precision};
}

template <piko::Precision P, int Ulps>
using WithFunctions =
    IndexedRaster<shadedBy(P), FunctionShader<shadedBy(P), Ulps>>;

} // namespace raster

using piko::Precision;
struct ExactFunctions : raster::WithFunctions<Precision::Strict, 0> {};
struct FunctionsIn1Ulp : raster::WithFunctions<Precision::Strict, 1> {};
struct FunctionsIn4Ulps : raster::WithFunctions<Precision::Strict, 4> {};
struct RelaxedFunctions : raster::WithFunctions<Precision::Relaxed, 0> {};
