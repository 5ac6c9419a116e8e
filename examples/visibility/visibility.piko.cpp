//===- visibility.piko.cpp - A rasterizer that shades what is seen --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   vertices --> Vertex Shader
//                                  small
//   triangles --> Setup ------------------> Small Coverage
//                   |  \--------------------------------------> Coverage
//                   |    large                                     ^
//                   \----------> Clipper --------------------------/
//                     crossing a plane of depth or the guard band
//
//   each bin, when all of these are done --> Shade
//
// A visibility buffer (Burns and Hunt 2013): for each pixel the coverage stages
// keep the greatest key, which has the depth above and the triangle's number
// below. So the nearest triangle wins, and the first among equals, in whatever
// order they come, and small triangles need no bins. Then each pixel is shaded
// once, by the ray through it and its triangle, which needs nothing of the
// screen.
//
//===----------------------------------------------------------------------===//
#include <piko.h>
#include <piko/scene.h>

#include "../common/corner.h"
#include "../common/lighting.h"

#include <bit>

using namespace piko::scene;

namespace visibility {

using namespace raster;

// A vertex on the screen.
struct Corner {
  Point at;
  float nearness;   // 1 / w, which floats resolve as finely far away as near by
  uint32_t outside; // as of a ScreenVertex
};

// A triangle on the screen, its corners clockwise, and the pixels that it may
// cover.
struct ScreenTriangle {
  Point a, b, c;
  glm::vec3 nearness; // of a, b and c
  int32_t index;
  glm::u16vec2 lo, hi;
};

// One of few pixels, its corners relative to pixel `lo`.
struct SmallTriangle {
  Point a, b, c;
  glm::vec3 nearness;
  int32_t index;
  glm::ivec2 lo, last; // and the last pixel, from there
};

struct Visible {
  uint64_t key = 0;
};

struct State {
  Camera camera;
  Settings settings;
  piko::Buffer<Light> lights;
  piko::Buffer<Vertex> mesh;
  piko::Buffer<Triangle> triangles;
  piko::Buffer<Corner> vertices; // one for each Vertex
  piko::Image<Visible> visible;
  piko::Image<Color8> color;
};

inline glm::vec4 project(const Camera &camera, glm::vec3 position) {
  return camera.viewProjection * glm::vec4(position, 1);
}

//===----------------------------------------------------------------------===//
// Triangles on the screen
//===----------------------------------------------------------------------===//

struct VertexShader : piko::Stage<0, 0, 64, Vertex>, piko::Uses<State> {
  void process(const Vertex &v) {
    ScreenVertex s = toScreen(project(state().camera, v.position), domain());
    state().vertices[v.index] = {s.at, s.inverse, s.outside};
  }
};

inline PixelBox boxOf(Point a, Point b, Point c, glm::ivec2 size) {
  Point lo = {glm::min(glm::min(a.x, b.x), c.x),
              glm::min(glm::min(a.y, b.y), c.y)};
  Point hi = {glm::max(glm::max(a.x, b.x), c.x),
              glm::max(glm::max(a.y, b.y), c.y)};
  PixelBox box = pixelsBetween(lo, hi);
  return {glm::max(box.lo, 0), glm::min(box.hi, size - 1)};
}

// Finds the triangles that may cover pixels: small ones go to port 0, others to
// port 1, and those that must be clipped to port 2.
struct Setup
    : piko::Stage<0, 0, 64, Triangle, SmallTriangle, ScreenTriangle, Triangle>,
      piko::Uses<State> {
  void schedule(piko::BinId) { endStage<VertexShader>(); }

  void process(const Triangle &t) {
    const Corner &a = state().vertices[t.vertex.x];
    const Corner &b = state().vertices[t.vertex.y];
    const Corner &c = state().vertices[t.vertex.z];
    uint32_t outside = a.outside | b.outside | c.outside;
    if ((a.outside & b.outside & c.outside & outsideView) ||
        (outside & outsideRange))
      return;
    if (outside & outsideGuard)
      return emit(t, 2);
    PixelBox box = boxOf(a.at, b.at, c.at, domain());
    if (box.isEmpty())
      return;
    glm::vec3 nearness(a.nearness, b.nearness, c.nearness);
    auto place = [&](Point p) -> Point {
      return {p.x - box.lo.x * subpixels, p.y - box.lo.y * subpixels};
    };
    Point first = place(a.at), second = place(b.at), third = place(c.at);
    glm::ivec2 last = box.hi - box.lo;
    if (last.x < smallSide && last.y < smallSide && isNear(first) &&
        isNear(second) && isNear(third)) {
      if (turnClockwise<int32_t>(first, second, third, nearness))
        emit(SmallTriangle{first, second, third, nearness, t.index, box.lo,
                           last},
             0);
      return;
    }
    Point q = b.at, r = c.at;
    if (turnClockwise<int64_t>(a.at, q, r, nearness))
      emit(ScreenTriangle{a.at, q, r, nearness, t.index, glm::u16vec2(box.lo),
                          glm::u16vec2(box.hi)},
           1);
  }

private:
  // Small triangles have at most this many pixels in a row or a column.
  static constexpr int smallSide = piko::tunable("small", 8, 4, 6);

  // Exchanges b and c if a, b, c run counterclockwise; false if nothing can be
  // seen of the triangle.
  template <class Int>
  bool turnClockwise(Point a, Point &b, Point &c, glm::vec3 &nearness) {
    Int area = areaOf<Int>(a, b, c);
    if (area == 0 || (state().settings.cullBackFaces != 0 && area > 0))
      return false;
    if (area < 0) {
      std::swap(b, c);
      std::swap(nearness.y, nearness.z);
    }
    return true;
  }
};

// Cuts a triangle, and emits the parts of what is left. It is a kernel of its
// own, because it has much to do for few triangles.
struct Clipper : piko::Stage<0, 0, 64, Triangle, ScreenTriangle>,
                 piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::LoadBalance); }

  void process(const Triangle &t) {
    ClipCorner corners[maxCorners];
    for (int i = 0; i < 3; ++i)
      corners[i].position =
          project(state().camera, state().mesh[t.vertex[i]].position);
    int count = clipPolygon(corners, 3);
    Point points[maxCorners];
    float nearness[maxCorners];
    for (int i = 0; i < count; ++i) {
      glm::vec4 p = corners[i].position;
      if (!(p.w > 0))
        return;
      nearness[i] = 1 / p.w;
      points[i] = toPoint(glm::vec2(p) * nearness[i], domain());
    }
    int64_t area = 0;
    for (int i = 1; i + 1 < count; ++i)
      area += signedArea(points[0], points[i], points[i + 1]);
    if (area == 0 || (state().settings.cullBackFaces != 0 && area > 0))
      return;
    for (int i = 1; i + 1 < count; ++i) {
      Point a = points[0], b = points[i], c = points[i + 1];
      int64_t part = signedArea(a, b, c);
      glm::vec3 near(nearness[0], nearness[i], nearness[i + 1]);
      PixelBox box = boxOf(a, b, c, domain());
      if (area < 0) {
        std::swap(b, c);
        std::swap(near.y, near.z);
      }
      // One of the other sign is a fold of less than 1/256 pixel.
      if (part != 0 && (part < 0) == (area < 0) && !box.isEmpty())
        emit(ScreenTriangle{a, b, c, near, t.index, glm::u16vec2(box.lo),
                            glm::u16vec2(box.hi)},
             0);
    }
  }
};

//===----------------------------------------------------------------------===//
// What is seen
//===----------------------------------------------------------------------===//

// Larger for what is nearer, then for what comes first; 0: nothing is seen.
inline uint64_t keyOf(float nearness, int32_t index) {
  // The bits of positive numbers are ordered as the numbers are.
  return nearness > 0 ? uint64_t(std::bit_cast<uint32_t>(nearness)) << 32 |
                            ~uint32_t(index)
                      : 0;
}

// What there is to see of a triangle: its key at a pixel that it covers, or 0.
template <class Int> struct Seen {
  BasicEdges<Int> edges;
  float first, toB, toC;
  int32_t index;

  template <class T>
  Seen(const T &t) : edges(t.a, t.b, t.c), first(t.nearness.x), index(t.index) {
    float scale = 1.0f / float(areaOf<Int>(t.a, t.b, t.c));
    toB = (t.nearness.y - first) * scale;
    toC = (t.nearness.z - first) * scale;
  }

  uint64_t at(int x, int y) const {
    if (!edges.cover(x, y))
      return 0;
    // By the edges' values, which are exact, so that slivers have no error.
    return keyOf(first + float(edges.e1.at(x, y)) * toB +
                     float(edges.e2.at(x, y)) * toC,
                 index);
  }
};

struct SmallCoverage : piko::Stage<0, 0, 64, SmallTriangle>, piko::Uses<State> {
  void process(const SmallTriangle &t) {
    Seen<int32_t> seen(t);
    for (int y = 0; y <= t.last.y; ++y)
      for (int x = 0; x <= t.last.x; ++x)
        if (uint64_t key = seen.at(x, y))
          piko::atomicMax(state().visible({t.lo.x + x, t.lo.y + y}).key, key);
  }
};

template <int Bin>
struct Coverage : piko::Stage<Bin, Bin, 64, ScreenTriangle>, piko::Uses<State> {
  void assignBin(const ScreenTriangle &t) {
    this->assignToBoundingBox(t, glm::ivec2(t.lo), glm::ivec2(t.hi));
  }

  void schedule(piko::BinId) {
    this->template endStage<SmallCoverage>();
    this->specifyLanes(piko::Lanes::Iterations);
  }

  void process(const ScreenTriangle &t) {
    Seen<int64_t> seen(t);
    this->parallelForPixels(
        glm::ivec2(t.lo), glm::ivec2(t.hi), [&](glm::ivec2 p) {
          if (uint64_t key = seen.at(p.x, p.y))
            this->update(this->state().visible, p,
                         [&](Visible &v) { v.key = glm::max(v.key, key); });
        });
  }
};

//===----------------------------------------------------------------------===//
// How it looks
//===----------------------------------------------------------------------===//

template <int Bin, piko::Precision P>
struct Shade : piko::Stage<Bin, Bin, 64, Nothing>, piko::Uses<State> {
  void assignBin(const Nothing &n) { this->assignToAll(n); }

  void schedule(piko::BinId) {
    this->everyBin();
    this->template endStage<Coverage<Bin>>();
    this->specifyPrecision(P);
  }

  void process(const piko::List<Nothing> &) {
    this->parallelForPixels([&](glm::ivec2 p) {
      uint64_t key = this->state().visible(p).key;
      if (key == 0)
        return;
      glm::vec3 color = shade(p, int32_t(~uint32_t(key)));
      this->update(this->state().color, p,
                   [&](Color8 &c) { c = toColor8(glm::vec4(color, 1)); });
    });
  }

protected:
  // Of the triangle with this number, where the ray through a pixel meets it.
  glm::vec3 shade(glm::ivec2 p, int32_t index) {
    const State &s = this->state();
    const Triangle &t = s.triangles[index];
    const Vertex &a = s.mesh[t.vertex.x], &b = s.mesh[t.vertex.y],
                 &c = s.mesh[t.vertex.z];
    glm::vec2 at = (glm::vec2(p) + 0.5f) / glm::vec2(this->domain());
    glm::vec3 ray = s.camera.forward + s.camera.right * (2 * at.x - 1) +
                    s.camera.up * (1 - 2 * at.y);
    // Moeller and Trumbore (1997), all times the determinant.
    glm::vec3 ab = b.position - a.position, ac = c.position - a.position;
    glm::vec3 from = s.camera.eye - a.position;
    glm::vec3 p0 = glm::cross(ray, ac), q0 = glm::cross(from, ab);
    float det = glm::dot(ab, p0);
    float v = glm::dot(from, p0), w = glm::dot(ray, q0), u = det - v - w;
    glm::vec3 position = s.camera.eye + ray * (glm::dot(ac, q0) / det);
    glm::vec3 normal = a.normal * u + b.normal * v + c.normal * w;
    normal = glm::normalize(det < 0 ? -normal : normal);
    glm::vec3 sum(s.settings.ambient);
    for (int64_t i = 0; i < s.lights.size(); ++i)
      sum += irradiance(s.lights[i], position, normal);
    return s.settings.albedo * sum;
  }
};

template <int Bin, piko::Precision P = piko::Precision::Strict,
          class Shader = Shade<Bin, P>>
struct Pipeline : piko::Pipe<State> {
  VertexShader vertexShader;
  Setup setup;
  Clipper clipper;
  SmallCoverage smallCoverage;
  Coverage<Bin> coverage;
  Shader shade;

  Pipeline() {
    this->source(vertexShader);
    this->source(setup);
    this->source(shade);
    this->connect(setup, 0, smallCoverage);
    this->connect(setup, 1, coverage);
    this->connect(setup, 2, clipper);
    this->connect(clipper, 0, coverage);
    this->allocateForSource(this->state().vertices, 0);
    this->expectIndex<&Vertex::index>(0, this->state().vertices);
    this->expectIndex<&Triangle::vertex>(1, this->state().vertices);
    this->expectIndex<&Triangle::vertex>(this->state().triangles,
                                         this->state().mesh);
  }
};

// The side of a bin, in pixels.
constexpr int tile = piko::tunable("tile", 64, 32, 128);

} // namespace visibility

struct Visibility : visibility::Pipeline<visibility::tile> {};
struct RelaxedVisibility
    : visibility::Pipeline<visibility::tile, piko::Precision::Relaxed> {};
