//===- raster.piko.cpp - A triangle rasterizer, mapped in several ways ----===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   triangles --> Vertex Shader --> Rasterizer --> Fragment Shader
//                                                        |
//                                    Composite <-- Depth Test
//
// The pipelines differ in template parameters and directives only:
//
//   Baseline     one bin, the whole screen; each stage is a kernel
//   FreePipe     one bin; each core takes its share through all stages, which
//                are one kernel
//   Binned       bins of 8 x 8 pixels; each stage is a kernel
//   BinnedFused  the Rasterizer and the Fragment Shader are one kernel
//   Bucketed     all cores share a strip of triangles and finish it
//
// and three in which triangles refer to vertices that are shaded once:
//
//   Indexed      as Baseline
//   Fused        Setup finds the pixels of a triangle; bins of 32 x 32 pixels,
//                and all stages from the Rasterizer on are one kernel
//   Tiled        as Fused; the fragments of a bin are shaded when all of them
//                are there
//
//===----------------------------------------------------------------------===//
#include <piko.h>
#include <piko/scene.h>

#include "../common/corner.h"
#include "../common/lighting.h"
#include "../common/mapping.h"

using namespace piko::scene;

namespace raster {

struct ShadedVertex {
  ScreenVertex screen;
  glm::vec3 position;
  glm::vec3 normal;
};

struct ShadedTriangle {
  ShadedVertex corner[3];
};

// A triangle that may cover pixels, and among which they are.
struct BoxedTriangle {
  glm::ivec3 vertex;
  glm::u16vec2 lo, hi;
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
  piko::Image<Depth> depth;
  piko::Image<Color> color;
};

inline glm::vec4 project(const Camera &camera, glm::vec3 position) {
  return camera.viewProjection * glm::vec4(position, 1);
}

//===----------------------------------------------------------------------===//
// Triangles that carry their vertices
//===----------------------------------------------------------------------===//

struct MeshState : State {
  piko::Buffer<Vertex> mesh;
};

// Shades the vertices of a triangle.
template <Mapping M>
struct TriangleShader : piko::Stage<0, 0, 64, Triangle, ShadedTriangle>,
                        piko::Uses<MeshState> {
  void schedule(piko::BinId) { this->specifySchedule(M.core, M.split); }

  void process(const Triangle &t) {
    ShadedTriangle out;
    for (int i = 0; i < 3; ++i) {
      const Vertex &v = this->state().mesh[t.vertex[i]];
      glm::vec4 clip = project(this->state().camera, v.position);
      out.corner[i] = {toScreen(clip, this->domain()), v.position, v.normal};
    }
    this->emit(out, 0);
  }
};

//===----------------------------------------------------------------------===//
// Triangles that refer to vertices
//===----------------------------------------------------------------------===//

struct IndexedState : MeshState {
  piko::Buffer<ScreenVertex> vertices; // one for each Vertex
};

// Finds each vertex's place on the screen once, and leaves it where triangles
// find it.
struct VertexShader : piko::Stage<0, 0, 64, Vertex>, piko::Uses<IndexedState> {
  void process(const Vertex &v) {
    state().vertices[v.index] =
        toScreen(project(state().camera, v.position), domain());
  }
};

// Finds the triangles that may cover pixels.
struct Setup : piko::Stage<0, 0, 64, Triangle, BoxedTriangle>,
               piko::Uses<IndexedState> {
  void schedule(piko::BinId) { endStage<VertexShader>(); }

  void process(const Triangle &t) {
    auto corner = [&](int i) -> const ScreenVertex & {
      return state().vertices[t.vertex[i]];
    };
    auto clip = [&](int i) {
      return project(state().camera, state().mesh[t.vertex[i]].position);
    };
    PixelBox box = boxOf(corner(0), corner(1), corner(2), clip, domain(),
                         state().settings.cullBackFaces != 0);
    box = coveredPart(corner(0), corner(1), corner(2), box);
    if (!box.isEmpty())
      emit(BoxedTriangle{t.vertex, glm::u16vec2(box.lo), glm::u16vec2(box.hi)},
           0);
  }
};

//===----------------------------------------------------------------------===//
// From triangles to pixels
//===----------------------------------------------------------------------===//

// Finds the pixels of a triangle that lie in the bin.
template <Mapping M, class Triangle, class UsedState, class Out = Fragment>
struct Rasterizer : piko::Stage<M.bin, M.bin, 64, Triangle, Out>,
                    piko::Uses<UsedState> {
  void assignBin(const Triangle &t) {
    if constexpr (M.bin == 0) {
      this->assignToBin(t, piko::BinId{0});
    } else {
      PixelBox box = boxIn(t);
      this->assignToBoundingBox(t, box.lo, box.hi);
    }
  }

  void schedule(piko::BinId) { this->specifySchedule(M.core, M.split); }

  void process(const Triangle &t) {
    PixelBox box = boxIn(t);
    const auto &a = surface(t, 0), &b = surface(t, 1), &c = surface(t, 2);
    rasterize(
        screen(t, 0), screen(t, 1), screen(t, 2),
        [&](int i) { return clip(t, i); }, box, this->binLo(), this->binHi(),
        this->domain(), cullBackFaces(),
        [&](glm::ivec2 lo, glm::ivec2 hi, auto f) {
          this->parallelForPixels(lo, hi, f);
        },
        [&](const Sample &s) {
          glm::vec3 w = s.weight;
          this->emit(Out{s.pixel, s.depth,
                         a.position * w.x + b.position * w.y + c.position * w.z,
                         a.normal * w.x + b.normal * w.y + c.normal * w.z},
                     0);
        });
  }

private:
  static constexpr bool isIndexed = std::is_same_v<Triangle, BoxedTriangle>;

  bool cullBackFaces() { return this->state().settings.cullBackFaces != 0; }

  // A corner's place on the screen.
  const ScreenVertex &screen(const Triangle &t, int i) {
    if constexpr (isIndexed)
      return this->state().vertices[t.vertex[i]];
    else
      return t.corner[i].screen;
  }

  // What has a corner's position and normal.
  const auto &surface(const Triangle &t, int i) {
    if constexpr (isIndexed)
      return this->state().mesh[t.vertex[i]];
    else
      return t.corner[i];
  }

  glm::vec4 clip(const Triangle &t, int i) {
    return project(this->state().camera, surface(t, i).position);
  }

  PixelBox boxIn(const Triangle &t) {
    if constexpr (isIndexed)
      return {glm::ivec2(t.lo), glm::ivec2(t.hi)};
    else
      return boxOf(
          screen(t, 0), screen(t, 1), screen(t, 2),
          [&](int i) { return clip(t, i); }, this->domain(), cullBackFaces());
  }
};

// Sums up the lights at a fragment.
template <Mapping M>
struct FragmentShader : piko::Stage<M.bin, M.bin, 64, Fragment, ShadedFragment>,
                        piko::Uses<State> {
  void assignBin(const Fragment &f) {
    this->assignToBin(f, this->binFromPosition(f.pixel));
  }
  void schedule(piko::BinId) {
    if constexpr (M.apart)
      this->specifySchedule(M.core, M.split);
    if constexpr (M.waits)
      this->endBin();
    this->specifyPrecision(M.precision);
  }

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
template <Mapping M>
struct DepthTest : piko::Stage<M.bin, M.bin, 64, ShadedFragment, PixelColor>,
                   piko::Uses<State> {
  void assignBin(const ShadedFragment &f) {
    this->assignToBin(f, this->binFromPosition(f.pixel));
  }
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
      this->emit(PixelColor{f.pixel, f.color}, 0);
  }
};

// Writes the colours that passed.
template <Mapping M>
struct Composite : piko::Stage<M.bin, M.bin, 64, PixelColor>,
                   piko::Uses<State> {
  void assignBin(const PixelColor &p) {
    this->assignToBin(p, this->binFromPosition(p.pixel));
  }
  void schedule(piko::BinId) {
    if constexpr (M.apart)
      this->specifySchedule(M.rest, M.split);
  }

  void process(const PixelColor &p) {
    this->update(state().color, p.pixel,
                 [&](Color &c) { c.rgba = glm::vec4(p.color, 1); });
  }
};

// What follows the Rasterizer.
template <Mapping M, class UsedState, class Shader = FragmentShader<M>>
struct Pixels : piko::Pipe<UsedState> {
  Shader fragmentShader;
  DepthTest<M> depthTest;
  Composite<M> composite;

  void connectPixels(auto &rasterizer) {
    this->connect(rasterizer, 0, fragmentShader);
    this->connect(fragmentShader, 0, depthTest);
    this->connect(depthTest, 0, composite);
  }
};

template <Mapping M> struct LinearRaster : Pixels<M, MeshState> {
  TriangleShader<M> vertexShader;
  Rasterizer<M, ShadedTriangle, MeshState> rasterizer;

  LinearRaster() {
    this->source(vertexShader);
    this->connect(vertexShader, 0, rasterizer);
    this->connectPixels(rasterizer);
  }
};

template <Mapping M, class Shader = FragmentShader<M>>
struct IndexedRaster : Pixels<M, IndexedState, Shader> {
  VertexShader vertexShader;
  Setup setup;
  Rasterizer<M, BoxedTriangle, IndexedState> rasterizer;

  IndexedRaster() {
    this->source(vertexShader);
    this->source(setup);
    this->connect(setup, 0, rasterizer);
    this->connectPixels(rasterizer);
    this->allocateForSource(this->state().vertices, 0);
    // What scenes have been read to have is tested once, not in each stage.
    this->template expectIndex<&Vertex::index>(0, this->state().vertices);
    this->template expectIndex<&Triangle::vertex>(1, this->state().vertices);
    this->template expectIndex<&Triangle::vertex>(1, this->state().mesh);
  }
};

using piko::All;
using piko::DirectMap;
using piko::LoadBalance;

} // namespace raster

struct Baseline : raster::LinearRaster<{.bin = 0}> {};
struct FreePipe : raster::LinearRaster<{.bin = 0, .core = raster::DirectMap}> {
};
struct Binned : raster::LinearRaster<{.bin = 8}> {};
struct BinnedFused
    : raster::LinearRaster<{
          .bin = 8, .core = raster::DirectMap, .rest = raster::LoadBalance}> {};
struct Bucketed
    : raster::LinearRaster<{.bin = 0, .core = raster::All, .split = 4096}> {};
struct Indexed : raster::IndexedRaster<{.bin = 0}> {};

// What piko-tune may choose for the last two.
namespace raster {
constexpr int tile = piko::tunable("tile", 32, 8, 16, 64);
constexpr auto shading =
    piko::tunable("shading", piko::Precision::Strict,
                  piko::Precision::Contracted, piko::Precision::Relaxed);
} // namespace raster

struct Fused
    : raster::IndexedRaster<{
          .bin = raster::tile, .apart = false, .precision = raster::shading}> {
};
struct Tiled : raster::IndexedRaster<{.bin = raster::tile,
                                      .apart = false,
                                      .waits = true,
                                      .precision = raster::shading}> {};
