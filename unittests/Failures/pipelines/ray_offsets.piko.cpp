// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where a shadow ray begins. `FixedOffsetRays` lifts it off its surface by the
// same distance in all scenes; the example by what rounding may have moved it.
#include "raytrace/raytrace.piko.cpp"

namespace offsets {

using namespace raytrace;

template <Mapping M>
struct FixedShade : piko::Stage<M.bin, M.bin, 64, Surface, Ray, Radiance>,
                    piko::Uses<State> {
  static constexpr float offset = 1e-4f;

  void assignBin(const Surface &s) { this->assignToPreviousBins(s); }
  void process(const Surface &s) {
    const Triangle &t = this->state().triangles[s.triangle];
    const Vertex &a = this->state().vertices[t.vertex.x];
    const Vertex &b = this->state().vertices[t.vertex.y];
    const Vertex &c = this->state().vertices[t.vertex.z];
    glm::vec3 w = s.corners;
    glm::vec3 p = a.position * w.x + b.position * w.y + c.position * w.z;
    glm::vec3 n =
        glm::normalize(a.normal * w.x + b.normal * w.y + c.normal * w.z);
    glm::vec3 weight = s.weight * this->state().settings.albedo;
    for (int64_t i = 0; i < this->state().lights.size(); ++i) {
      const Light &light = this->state().lights[i];
      glm::vec3 color = raster::irradiance(light, p, n);
      glm::vec3 l = glm::vec3(light.position) - light.position.w * p;
      float limit = light.position.w != 0 ? 1 : INFINITY;
      this->emit(Ray{s.pixel, p + offset * n, l, limit, weight * color, -1}, 0);
    }
    glm::vec3 ambient(this->state().settings.ambient);
    this->emit(Radiance{s.pixel, weight * ambient}, 1);
  }
};

template <Mapping M> struct FixedRaytracer : piko::Pipe<State> {
  Primary<M> primary;
  Trace<M> trace;
  FixedShade<M> shade;
  Accumulate<M> accumulate;

  FixedRaytracer() {
    source(primary);
    connect(primary, 0, shade);
    connect(trace, 0, shade);
    connect(trace, 1, accumulate);
    connect(shade, 0, trace);
    connect(shade, 1, accumulate);
  }
};

} // namespace offsets

struct FixedOffsetRays : offsets::FixedRaytracer<{.bin = 16, .apart = false}> {
};
struct ExampleRays : raytrace::MappedRaytracer<{.bin = 16, .apart = false}> {};
