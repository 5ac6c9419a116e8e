//===- shadow.piko.cpp - A rasterizer with a shadow map -------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   vertices ---> Vertex Shader - - - (shaded vertices)
//   vertices ---> Fit - - - - - - - - (extent of the scene)
//                                       :
//   triangles --> Project ---> Shadow Map - - - (map)
//                                                 :
//   triangles --> Rasterizer -----------> Fragment Shader ---> Depth Test
//
// The first light that shines from a direction casts shadows. The branch that
// draws its map and the one that draws have bins of their own; the Fragment
// Shader waits for the whole map. The pipelines differ in nothing but bins.
//
//===----------------------------------------------------------------------===//
#include <piko.h>
#include <piko/scene.h>

#include "../common/clip.h"
#include "../common/lighting.h"
#include "../common/mapping.h"
#include "light_view.h"

using namespace piko::scene;

namespace shadow {

using raster::Mapping;

struct ShadedVertex {
  glm::vec4 clip;
  glm::vec3 position;
  glm::vec3 normal;
};

struct LightTriangle {
  glm::vec4 clip[3]; // as the light sees it
};

struct Fragment {
  glm::ivec2 pixel;
  float depth;
  glm::vec3 position;
  glm::vec3 normal;
};

struct ShadedFragment {
  glm::ivec2 pixel;
  float depth;
  glm::vec3 color;
};

struct Depth {
  float z = 1; // the far plane
};

struct State {
  Camera camera;
  Settings settings;
  int32_t texels = 1; ///< by which a shadow's edge is blurred, on either side
  float bias = 1.5f; ///< texels by whose slope surfaces are above the map: half
                     ///< a texel more than the blur
  piko::Buffer<Light> lights;
  piko::Buffer<Box> reach;             // of all vertices, in the first element
  piko::Buffer<ShadedVertex> vertices; // one for each Vertex
  piko::Image<Depth> map;              // as the light sees it
  piko::Image<Depth> depth;
  piko::Image<Color> color;
};

// Finds the box that the light's view must hold.
struct Fit : piko::Stage<0, 0, 64, Vertex>, piko::Uses<State> {
  void process(const piko::List<Vertex> &vertices) {
    int64_t sun = findSun(state().lights);
    if (sun < 0)
      return;
    LightAxes axes(state().lights[sun].position);
    state().reach[0] = reduce<Box>(
        int(vertices.size()),
        [&](int i) { return axes.boxOf(vertices[i].position); }, unite, Box{});
  }
};

struct VertexShader : piko::Stage<0, 0, 64, Vertex>, piko::Uses<State> {
  void process(const Vertex &v) {
    state().vertices[v.index] = {state().camera.viewProjection *
                                     glm::vec4(v.position, 1),
                                 v.position, v.normal};
  }
};

// Turns a triangle to the light.
struct Project : piko::Stage<0, 0, 64, Triangle, LightTriangle>,
                 piko::Uses<State> {
  void schedule(piko::BinId) {
    endStage<Fit>();
    endStage<VertexShader>();
  }

  void process(const Triangle &t) {
    int64_t sun = findSun(state().lights);
    if (sun < 0)
      return;
    LightView view(state().lights[sun].position, state().reach[0], domain());
    emit({{view.clip(state().vertices[t.vertex.x].position),
           view.clip(state().vertices[t.vertex.y].position),
           view.clip(state().vertices[t.vertex.z].position)}});
  }
};

// Draws the depth of what is next to the light.
template <Mapping M>
struct ShadowMap : piko::Stage<M.bin, M.bin, 64, LightTriangle>,
                   piko::Uses<State> {
  void assignBin(const LightTriangle &t) {
    raster::PixelBox box = polygon(t).box();
    this->assignToBoundingBox(t, box.lo, box.hi);
  }

  void schedule(piko::BinId) { this->specifySchedule(M.core, M.split); }

  void process(const LightTriangle &t) {
    polygon(t).rasterize([&](glm::ivec2 lo, glm::ivec2 hi,
                             auto f) { this->parallelForPixels(lo, hi, f); },
                         [&](const raster::Sample &s) {
                           this->update(
                               state().map, s.pixel, [&](Depth &nearest) {
                                 nearest.z = piko::min(nearest.z, s.depth);
                               });
                         });
  }

private:
  raster::ScreenPolygon polygon(const LightTriangle &t) {
    return raster::ScreenPolygon(t.clip[0], t.clip[1], t.clip[2],
                                 this->domain(), false);
  }
};

// Finds the pixels of a triangle that lie in the bin.
template <Mapping M>
struct Rasterizer : piko::Stage<M.bin, M.bin, 64, Triangle, Fragment>,
                    piko::Uses<State> {
  void assignBin(const Triangle &t) {
    raster::PixelBox box = project(t).box();
    this->assignToBoundingBox(t, box.lo, box.hi);
  }

  void schedule(piko::BinId) {
    this->template endStage<VertexShader>();
    this->specifySchedule(M.core, M.split);
  }

  void process(const Triangle &t) {
    const ShadedVertex &a = state().vertices[t.vertex.x];
    const ShadedVertex &b = state().vertices[t.vertex.y];
    const ShadedVertex &c = state().vertices[t.vertex.z];
    project(t).rasterize(
        [&](glm::ivec2 lo, glm::ivec2 hi, auto f) {
          this->parallelForPixels(lo, hi, f);
        },
        [&](const raster::Sample &s) {
          glm::vec3 w = s.weight;
          this->emit({s.pixel, s.depth,
                      a.position * w.x + b.position * w.y + c.position * w.z,
                      a.normal * w.x + b.normal * w.y + c.normal * w.z});
        });
  }

private:
  raster::ScreenPolygon project(const Triangle &t) {
    return raster::ScreenPolygon(
        state().vertices[t.vertex.x].clip, state().vertices[t.vertex.y].clip,
        state().vertices[t.vertex.z].clip, this->domain(),
        state().settings.cullBackFaces != 0);
  }
};

// Sums up the lights at a fragment; the sun as far as it is seen from there.
template <Mapping Map, Mapping M>
struct FragmentShader : piko::Stage<M.bin, M.bin, 64, Fragment, ShadedFragment>,
                        piko::Uses<State> {
  void assignBin(const Fragment &f) { this->assignToPreviousBins(f); }

  void schedule(piko::BinId) {
    this->template endStage<ShadowMap<Map>>();
    if constexpr (M.apart)
      this->specifySchedule(M.core, M.split);
  }

  void process(const Fragment &f) {
    glm::vec3 n = glm::normalize(f.normal);
    glm::vec3 sum(state().settings.ambient);
    int64_t sun = findSun(state().lights);
    for (int64_t i = 0; i < state().lights.size(); ++i) {
      const Light &light = state().lights[i];
      float visible = i == sun ? visibility(f.position, n, light.position) : 1;
      sum += visible * raster::irradiance(light, f.position, n);
    }
    this->emit({f.pixel, f.depth, state().settings.albedo * sum});
  }

private:
  // How much of the sun is seen.
  float visibility(glm::vec3 position, glm::vec3 normal, glm::vec3 toLight) {
    if (!(glm::dot(normal, toLight) > 0))
      return 0; // turned away
    LightView view(toLight, state().reach[0], this->domain());
    glm::vec3 at = view.lookup(position, normal, state().bias);
    return filterShadow(glm::vec2(at), state().texels,
                        [&](glm::ivec2 t) { return isLit(t, at.z); });
  }

  bool isLit(glm::ivec2 texel, float depth) {
    return glm::any(glm::lessThan(texel, glm::ivec2(0))) ||
           glm::any(glm::greaterThanEqual(texel, this->domain())) ||
           depth <= state().map(texel).z;
  }
};

// Lets the nearest fragment's colour stay.
template <Mapping M>
struct DepthTest : piko::Stage<M.bin, M.bin, 64, ShadedFragment>,
                   piko::Uses<State> {
  void assignBin(const ShadedFragment &f) { this->assignToPreviousBins(f); }
  void schedule(piko::BinId) {
    if constexpr (M.apart)
      this->specifySchedule(M.rest, M.split);
  }

  void process(const ShadedFragment &f) {
    bool passed = false;
    this->update(state().depth, f.pixel, [&](Depth &nearest) {
      passed = f.depth < nearest.z;
      if (passed)
        nearest.z = f.depth;
    });
    if (passed)
      this->update(state().color, f.pixel,
                   [&](Color &c) { c.rgba = glm::vec4(f.color, 1); });
  }
};

template <Mapping Map, Mapping M> struct Shadow : piko::Pipe<State> {
  Fit fit;
  VertexShader vertexShader;
  Project project;
  ShadowMap<Map> shadowMap;
  Rasterizer<M> rasterizer;
  FragmentShader<Map, M> fragmentShader;
  DepthTest<M> depthTest;

  Shadow() {
    source(fit);
    source(vertexShader);
    source(project);
    source(rasterizer);
    connect(project, 0, shadowMap);
    connect(rasterizer, 0, fragmentShader);
    connect(fragmentShader, 0, depthTest);
    allocateForSource(state().reach, 0);
    allocateForSource(state().vertices, 1);
    expectIndex<&Vertex::index>(1, state().vertices);
    expectIndex<&Triangle::vertex>(2, state().vertices);
    expectIndex<&Triangle::vertex>(3, state().vertices);
  }
};

struct WholeScreen : Shadow<{.bin = 0}, {.bin = 0, .apart = false}> {};
struct Bins8 : Shadow<{.bin = 8}, {.bin = 8, .apart = false}> {};
struct Bins16 : Shadow<{.bin = 16}, {.bin = 16, .apart = false}> {};
struct Bins32 : Shadow<{.bin = 32}, {.bin = 32, .apart = false}> {};
struct MapBins32 : Shadow<{.bin = 32}, {.bin = 8, .apart = false}> {};

} // namespace shadow
