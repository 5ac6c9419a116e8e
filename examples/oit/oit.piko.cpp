//===- oit.piko.cpp - Transparency in any order of triangles --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   vertices ---> Vertex Shader - - - - - - (shaded vertices)
//                                                  :
//   triangles --> Rasterizer ---> Fragment Shader ---> Blend
//
// All surfaces are thin sheets. Blend waits for all layers of its bin, sorts
// them and composes them from back to front. So the order of the triangles does
// not matter, except that of two at the same depth the first is in front.
//
// The pipelines differ in nothing but the size of their bins.
//
//===----------------------------------------------------------------------===//
#include <piko.h>
#include <piko/scene.h>

#include "../common/clip.h"
#include "../common/lighting.h"
#include "../common/mapping.h"

using namespace piko::scene;

namespace oit {

using raster::Mapping;

struct ShadedVertex {
  glm::vec4 clip;
  glm::vec3 position;
  glm::vec3 normal;
};

struct Fragment {
  glm::ivec2 pixel;
  float depth;
  glm::vec3 position;
  glm::vec3 normal;
};

struct Layer {
  glm::ivec2 pixel;
  float depth;
  glm::vec4 rgba; // premultiplied
};

struct Material {
  float alpha = 0.25f; // how much of the light a sheet stops that faces it
};

struct State {
  Camera camera;
  Settings settings;
  Material material;
  piko::Buffer<Light> lights;
  piko::Buffer<ShadedVertex> vertices; // one for each Vertex
  piko::Image<Color> color;
};

struct VertexShader : piko::Stage<0, 0, 64, Vertex>, piko::Uses<State> {
  void process(const Vertex &v) {
    state().vertices[v.index] = {state().camera.viewProjection *
                                     glm::vec4(v.position, 1),
                                 v.position, v.normal};
  }
};

// Finds the pixels of a triangle that lie in the bin and before the far plane.
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
          if (s.depth < 1)
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

template <Mapping M>
struct FragmentShader : piko::Stage<M.bin, M.bin, 64, Fragment, Layer>,
                        piko::Uses<State> {
  void assignBin(const Fragment &f) { this->assignToPreviousBins(f); }
  void schedule(piko::BinId) {
    if constexpr (M.apart)
      this->specifySchedule(M.core, M.split);
  }

  void process(const Fragment &f) {
    glm::vec3 n = glm::normalize(f.normal);
    glm::vec3 toEye = glm::normalize(state().camera.eye - f.position);
    float facing = glm::dot(n, toEye);
    if (facing < 0) // a sheet has two sides
      n = -n;
    glm::vec3 sum(state().settings.ambient);
    for (int64_t i = 0; i < state().lights.size(); ++i)
      sum += raster::irradiance(state().lights[i], f.position, n);
    // Light that meets the sheet at an angle has a longer way through it.
    float way = 1 / glm::abs(facing);
    float alpha = 1 - piko::pow(1 - state().material.alpha, way);
    this->emit({f.pixel, f.depth,
                glm::vec4(state().settings.albedo * sum * alpha, alpha)});
  }
};

// Composes the layers of all pixels of a bin, from back to front.
template <Mapping M>
struct Blend : piko::Stage<M.bin, M.bin, 64, Layer>, piko::Uses<State> {
  void assignBin(const Layer &l) {
    this->assignToBin(l, this->binFromPosition(l.pixel));
  }

  void schedule(piko::BinId) {
    this->endBin();
    if constexpr (M.apart)
      this->specifySchedule(M.rest, M.split);
  }

  void process(const piko::List<Layer> &layers) {
    int last = int(layers.size()) - 1;
    this->parallelFor(last + 1, [&](int i) {
      // What is equal is sorted by iteration: the layers are taken from the
      // last on, so that the first of equal depth ends up in front.
      int rank = this->sort(-layers[last - i].depth);
      const Layer &l = layers[last - rank];
      // The updates of a pixel are made in the order of the iterations.
      this->update(state().color, l.pixel, [&](Color &behind) {
        behind.rgba = l.rgba + (1 - l.rgba.a) * behind.rgba;
      });
    });
  }
};

template <Mapping M> struct Oit : piko::Pipe<State> {
  VertexShader vertexShader;
  Rasterizer<M> rasterizer;
  FragmentShader<M> fragmentShader;
  Blend<M> blend;

  Oit() {
    source(vertexShader);
    source(rasterizer);
    connect(rasterizer, 0, fragmentShader);
    connect(fragmentShader, 0, blend);
    allocateForSource(state().vertices, 0);
    expectIndex<&Vertex::index>(0, state().vertices);
    expectIndex<&Triangle::vertex>(1, state().vertices);
  }
};

struct WholeScreen : Oit<{.bin = 0, .apart = false}> {};
struct Bins8 : Oit<{.bin = 8, .apart = false}> {};
struct Bins16 : Oit<{.bin = 16, .apart = false}> {};
struct Bins32 : Oit<{.bin = 32, .apart = false}> {};

} // namespace oit
