//===- raster.piko.cpp - A triangle rasterizer in five stages -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   vertices ---> Vertex Shader - - - - - - (shaded vertices)
//                                                  :
//   triangles --> Rasterizer ---> Fragment Shader ---> Depth Test --->
//   Composite
//
// Two pipelines share the stages: `Baseline`, where every bin is the whole
// screen, and `Binned`, with bins of 8 x 8 pixels from the Rasterizer on.
//
//===----------------------------------------------------------------------===//
#include <piko.h>
#include <piko/scene.h>

#include "../common/clip.h"
#include "../common/lighting.h"

using namespace piko::scene;

namespace raster {

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

struct ShadedFragment {
  glm::ivec2 pixel;
  float depth;
  glm::vec3 color;
};

struct PixelColor {
  glm::ivec2 pixel;
  glm::vec3 color;
};

struct Depth {
  float z = 1; // the far plane
};

struct State {
  Camera camera;
  Settings settings;
  piko::Buffer<Light> lights;
  piko::Buffer<ShadedVertex> vertices; // one for each Vertex
  piko::Image<Depth> depth;
  piko::Image<Color> color;
};

// Shades each vertex once, and leaves it where triangles find it.
struct VertexShader : piko::Stage<0, 0, 64, Vertex>, piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::LoadBalance); }

  void process(const Vertex &v) {
    ShadedVertex &out = state().vertices[v.index];
    out.clip = state().camera.viewProjection * glm::vec4(v.position, 1);
    out.position = v.position;
    out.normal = v.normal;
  }
};

// Finds the pixels of a triangle that lie in the bin.
template <int Bin>
struct Rasterizer : piko::Stage<Bin, Bin, 64, Triangle, Fragment>,
                    piko::Uses<State> {
  void assignBin(const Triangle &t) {
    if constexpr (Bin == 0) {
      this->assignToBin(t, piko::BinId{0});
    } else {
      PixelBox box = project(t).box();
      this->assignToBoundingBox(t, box.lo, box.hi);
    }
  }

  void schedule(piko::BinId) {
    this->specifySchedule(piko::LoadBalance);
    this->template endStage<VertexShader>();
  }

  void process(const Triangle &t) {
    const ShadedVertex &a = state().vertices[t.vertex.x];
    const ShadedVertex &b = state().vertices[t.vertex.y];
    const ShadedVertex &c = state().vertices[t.vertex.z];
    project(t).rasterize(this->binLo(), this->binHi(), [&](const Sample &s) {
      glm::vec3 w = s.weight;
      this->emit(
          Fragment{s.pixel, s.depth,
                   a.position * w.x + b.position * w.y + c.position * w.z,
                   a.normal * w.x + b.normal * w.y + c.normal * w.z},
          0);
    });
  }

private:
  ScreenPolygon project(const Triangle &t) {
    return ScreenPolygon(state().vertices[t.vertex.x].clip,
                         state().vertices[t.vertex.y].clip,
                         state().vertices[t.vertex.z].clip, this->domain(),
                         state().settings.cullBackFaces != 0);
  }
};

// Sums up the lights at a fragment.
template <int Bin>
struct FragmentShader : piko::Stage<Bin, Bin, 64, Fragment, ShadedFragment>,
                        piko::Uses<State> {
  void assignBin(const Fragment &f) {
    this->assignToBin(f, this->binFromPosition(f.pixel));
  }
  void schedule(piko::BinId) { this->specifySchedule(piko::LoadBalance); }

  void process(const Fragment &f) {
    glm::vec3 n = glm::normalize(f.normal);
    glm::vec3 sum(state().settings.ambient);
    for (int64_t i = 0; i < state().lights.size(); ++i)
      sum += irradiance(state().lights[i], f.position, n);
    this->emit(ShadedFragment{f.pixel, f.depth, state().settings.albedo * sum},
               0);
  }
};

// Lets a fragment pass that is nearer than all before it.
template <int Bin>
struct DepthTest : piko::Stage<Bin, Bin, 64, ShadedFragment, PixelColor>,
                   piko::Uses<State> {
  void assignBin(const ShadedFragment &f) {
    this->assignToBin(f, this->binFromPosition(f.pixel));
  }
  void schedule(piko::BinId) { this->specifySchedule(piko::LoadBalance); }

  void process(const ShadedFragment &f) {
    bool passed = false;
    this->update(state().depth, f.pixel, [&](Depth &nearest) {
      passed = f.depth < nearest.z;
      if (passed)
        nearest.z = f.depth;
    });
    if (passed)
      this->emit(PixelColor{f.pixel, f.color}, 0);
  }
};

// Writes the colours that passed.
template <int Bin>
struct Composite : piko::Stage<Bin, Bin, 64, PixelColor>, piko::Uses<State> {
  void assignBin(const PixelColor &p) {
    this->assignToBin(p, this->binFromPosition(p.pixel));
  }
  void schedule(piko::BinId) { this->specifySchedule(piko::LoadBalance); }

  void process(const PixelColor &p) {
    this->update(state().color, p.pixel,
                 [&](Color &c) { c.rgba = glm::vec4(p.color, 1); });
  }
};

template <int Bin> struct Raster : piko::Pipe<State> {
  VertexShader vertexShader;
  Rasterizer<Bin> rasterizer;
  FragmentShader<Bin> fragmentShader;
  DepthTest<Bin> depthTest;
  Composite<Bin> composite;

  Raster() {
    source(vertexShader);
    source(rasterizer);
    connect(rasterizer, 0, fragmentShader);
    connect(fragmentShader, 0, depthTest);
    connect(depthTest, 0, composite);
    allocateForSource(state().vertices, 0);
  }
};

} // namespace raster

struct Baseline : raster::Raster<0> {};
struct Binned : raster::Raster<8> {};
