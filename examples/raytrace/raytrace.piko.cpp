//===- raytrace.piko.cpp - A ray tracer whose stages form a cycle ---------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//                 +---- shadow and mirror rays
//                 v                   |
//   Primary       Trace -----------> Shade
//      |          |  |                ^ |
//      +----------|--|----------------+ |
//                 |  +--> Accumulate <--+
//                 |        (image)
//
// Rays go through the tree in packets of 16, Primary's for a block of 4 x 4
// pixels. A ray stays in the bin of its pixel, and what the rays of a pixel
// bring is summed up in order of lineage.
//
//===----------------------------------------------------------------------===//
#include <piko.h>
#include <piko/scene.h>

#include "../common/lighting.h"
#include "../common/mapping.h"
#include "bvh.h"

using namespace piko::scene;

namespace raytrace {

using raster::Mapping;

struct Ray {
  glm::ivec2 pixel;
  glm::vec3 origin;
  glm::vec3 direction;
  float limit;      ///< hits have t < limit
  glm::vec3 weight; ///< in the pixel's color
  int32_t mirrors;  ///< how many it came from; -1: a shadow ray
};

struct Surface {
  glm::ivec2 pixel;
  glm::vec3 direction; ///< of the ray that met it
  glm::vec3 weight;
  int32_t mirrors;
  int32_t triangle;
  glm::vec3 corners; ///< weights of the triangle's corners
};

struct Radiance {
  glm::ivec2 pixel;
  glm::vec3 color;
};

struct State {
  Camera camera;
  Settings settings;
  int32_t depth = 2;    ///< how many mirrors are followed
  float mirror = 0.25f; ///< how much of the light surfaces mirror
  int32_t shadows = 1;  ///< 0: lights shine through
  Bounds bounds;
  piko::Buffer<BvhNode> nodes;
  piko::Buffer<BvhTriangle> leaves;
  piko::Buffer<Triangle> triangles;
  piko::Buffer<Vertex> vertices;
  piko::Buffer<Light> lights;
  piko::Image<Color> image;
};

// A stage whose parallel loops run over the rays of a packet.
template <Mapping M, class Test, class In, class... Out>
struct PacketStage : piko::Stage<M.bin, M.bin, 64, In, Out...>,
                     piko::Uses<State> {
protected:
  static constexpr int packet = 16;

  /// What a ray hits; an iteration that has none gives a limit below 0.
  typename Test::Hit find(glm::vec3 origin, glm::vec3 direction, float limit,
                          bool anyHit) {
    return findHit<Test>(
        origin, direction, limit, anyHit, this->state().bounds,
        this->state().nodes, this->state().leaves,
        [&](bool b) { return this->any(b); },
        [&](float t) {
          return this->reduce(t,
                              [](float a, float b) { return piko::min(a, b); });
        });
  }
};

// Follows the rays of the camera.
template <Mapping M, class Test = ShearedRay>
struct Primary : PacketStage<M, Test, Nothing, Surface> {
  void assignBin(const Nothing &n) { this->assignToAll(n); }
  void schedule(piko::BinId) {
    this->everyBin();
    this->specifySchedule(M.core, M.split);
  }

  void process(const piko::List<Nothing> &) {
    constexpr int side = 4;
    glm::ivec2 lo = this->binLo(), hi = this->binHi();
    for (int y = lo.y; y < hi.y; y += side)
      for (int x = lo.x; x < hi.x; x += side)
        this->parallelFor(this->packet,
                          [&](int i) { trace({x + i % side, y + i / side}); });
  }

private:
  void trace(glm::ivec2 at) {
    const Camera &c = this->state().camera;
    glm::vec2 size = this->domain(), middle = glm::vec2(at) + 0.5f;
    glm::vec3 direction = c.forward + c.right * (2 * middle.x / size.x - 1) +
                          c.up * (1 - 2 * middle.y / size.y);
    bool isPixel = glm::all(glm::lessThan(at, this->binHi()));
    auto hit = this->find(c.eye, direction, isPixel ? INFINITY : -1, false);
    if (hit.triangle >= 0)
      this->emit(
          Surface{at, direction, glm::vec3(1), 0, hit.triangle, hit.weight});
  }
};

// Follows the rays that come from surfaces.
template <Mapping M, class Test = ShearedRay>
struct Trace : PacketStage<M, Test, Ray, Surface, Radiance> {
  void assignBin(const Ray &r) { this->assignToPreviousBins(r); }
  void schedule(piko::BinId) {
    this->batch(this->packet);
    if constexpr (M.apart)
      this->specifySchedule(M.core, M.split);
  }

  void process(const piko::List<Ray> &rays) {
    this->parallelFor(this->packet, [&](int i) {
      bool isRay = i < rays.size();
      const Ray &r = rays[isRay ? i : 0];
      bool isShadow = r.mirrors < 0;
      auto hit =
          this->find(r.origin, r.direction, isRay ? r.limit : -1, isShadow);
      if (!isRay)
        return;
      if (hit.triangle >= 0) {
        if (!isShadow)
          this->emit(Surface{r.pixel, r.direction, r.weight, r.mirrors,
                             hit.triangle, hit.weight},
                     0);
      } else {
        glm::vec3 light = isShadow ? glm::vec3(1) : glm::vec3(Color().rgba);
        this->emit(Radiance{r.pixel, r.weight * light}, 1);
      }
    });
  }
};

template <Mapping M>
struct Shade : piko::Stage<M.bin, M.bin, 64, Surface, Ray, Radiance>,
               piko::Uses<State> {
  void assignBin(const Surface &s) { this->assignToPreviousBins(s); }
  void schedule(piko::BinId) {
    if constexpr (M.apart)
      this->specifySchedule(M.rest, M.split);
  }

  void process(const Surface &s) {
    Point p = pointOf(s);
    glm::vec3 weight = s.weight;
    // The first condition is for a pipeline whose depth is fixed to 0.
    if (this->state().depth > 0 && s.mirrors < this->state().depth) {
      float mirror = this->state().mirror;
      emitRay(s, p, mirrored(s.direction, p), INFINITY, weight * mirror,
              s.mirrors + 1);
      weight *= 1 - mirror;
    }
    weight *= this->state().settings.albedo;
    glm::vec3 sum(this->state().settings.ambient);
    for (int64_t i = 0; i < this->state().lights.size(); ++i) {
      const Light &light = this->state().lights[i];
      glm::vec3 color = raster::irradiance(light, p.position, p.normal);
      if (!glm::any(glm::greaterThan(color, glm::vec3(0))))
        continue; // it is behind the surface
      if (this->state().shadows == 0) {
        sum += color;
        continue;
      }
      bool isPoint = light.position.w != 0;
      glm::vec3 l = glm::vec3(light.position) - light.position.w * p.position;
      emitRay(s, p, l, isPoint ? 1 : INFINITY, weight * color, -1);
    }
    this->emit(Radiance{s.pixel, weight * sum}, 1);
  }

private:
  struct Point {
    glm::vec3 position;
    glm::vec3 normal; ///< unit length
    glm::vec3 facet;  ///< a normal of the triangle
  };

  Point pointOf(const Surface &s) {
    const Triangle &t = this->state().triangles[s.triangle];
    const Vertex &a = this->state().vertices[t.vertex.x];
    const Vertex &b = this->state().vertices[t.vertex.y];
    const Vertex &c = this->state().vertices[t.vertex.z];
    glm::vec3 w = s.corners;
    return {a.position * w.x + b.position * w.y + c.position * w.z,
            glm::normalize(a.normal * w.x + b.normal * w.y + c.normal * w.z),
            glm::cross(b.position - a.position, c.position - a.position)};
  }

  static glm::vec3 mirrored(glm::vec3 direction, const Point &p) {
    glm::vec3 d = glm::reflect(direction, p.normal);
    // A normal between those of the vertices may send it into the triangle.
    bool goesThrough = glm::dot(d, p.facet) * glm::dot(direction, p.facet) > 0;
    return goesThrough ? glm::reflect(direction, glm::normalize(p.facet)) : d;
  }

  void emitRay(const Surface &s, const Point &p, glm::vec3 direction,
               float limit, glm::vec3 weight, int32_t mirrors) {
    // It starts beside the triangle, farther than rounding (bvh.h) moves that.
    glm::vec3 size = glm::abs(p.facet);
    glm::vec3 mesh = glm::max(glm::abs(this->state().bounds.lo),
                              glm::abs(this->state().bounds.hi));
    float step = 64 * epsilon * greatest(mesh) / greatest(size);
    glm::vec3 start = p.position;
    if (step < INFINITY) // the triangle is not degenerate
      start += p.facet * (glm::dot(direction, p.facet) < 0 ? -step : step);
    this->emit(Ray{s.pixel, start, direction, limit, weight, mirrors}, 0);
  }

  static float greatest(glm::vec3 v) {
    return piko::max(piko::max(v.x, v.y), v.z);
  }
};

template <Mapping M>
struct Accumulate : piko::Stage<M.bin, M.bin, 64, Radiance>, piko::Uses<State> {
  void assignBin(const Radiance &r) { this->assignToPreviousBins(r); }
  void schedule(piko::BinId) {
    if constexpr (M.apart)
      this->specifySchedule(M.rest, M.split);
  }

  void process(const Radiance &r) {
    this->update(this->state().image, r.pixel, [&](Color &c) {
      if (c.rgba.a == 0)
        c.rgba = {0, 0, 0, 1};
      c.rgba += glm::vec4(r.color, 0);
    });
  }
};

template <Mapping M, class Test = ShearedRay>
struct MappedRaytracer : piko::Pipe<State> {
  Primary<M, Test> primary;
  Trace<M, Test> trace;
  Shade<M> shade;
  Accumulate<M> accumulate;

  MappedRaytracer() {
    source(primary);
    connect(primary, 0, shade);
    connect(trace, 0, shade);
    connect(trace, 1, accumulate);
    connect(shade, 0, trace);
    connect(shade, 1, accumulate);
  }
};

struct Raytracer : MappedRaytracer<{.bin = piko::tunable("tile", 16, 8, 32, 64),
                                    .apart = false}> {};

} // namespace raytrace
