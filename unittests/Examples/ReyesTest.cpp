//===- ReyesTest.cpp - The Reyes renderer under the reference -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "reyes/reyes.piko.cpp"

#include "FineTessellation.h"

#include "Piko/Scene/View.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace {

using namespace reyes;
using piko::FineTessellation;
using piko::render::boundingSphere;
using piko::render::makeCamera;
using piko::render::Mesh;
using piko::render::Sphere;
using piko::render::ViewOptions;

using Patches = std::vector<Patch>;
using Surface = std::function<glm::vec3(float, float)>;

/// A patch whose control points are those of a surface at thirds.
Patch patchOf(const Surface &surface) {
  Patch patch{};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      patch.points[4 * i + j] = surface(float(i) / 3, float(j) / 3);
  return patch;
}

/// The same surface, its parameters turned by so many right angles.
Patch turned(Patch patch, int quarters) {
  for (; quarters > 0; --quarters) {
    Patch before = patch;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        patch.points[4 * i + j] = before.points[4 * j + 3 - i];
  }
  return patch;
}

/// A closed surface about the origin: a cube of n x n patches a side, all
/// turned at random, whose control points are moved at random by up to `bumps`.
/// Each patch has its front outside. If `isPinched`, one edge of the cube is
/// nearly a point, so that borders of patches are far shorter than their
/// middle.
Patches makeLump(int n, float bumps, unsigned seed, bool isPinched = false) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> offset(-bumps, bumps);
  int last = 3 * n;
  // All points of the cube's lattice, so that neighbours find the same ones.
  std::vector<glm::vec3> lattice;
  for (int i = 0; i < (last + 1) * (last + 1) * (last + 1); ++i)
    lattice.emplace_back(offset(random), offset(random), offset(random));
  Patches patches;
  for (int face = 0; face < 6; ++face)
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b) {
        Patch patch{};
        for (int i = 0; i < 4; ++i)
          for (int j = 0; j < 4; ++j) {
            int axis = face / 2;
            glm::ivec3 cell;
            cell[axis] = face % 2 == 0 ? 0 : last;
            // The other axes in the order that turns outwards.
            cell[(axis + (face % 2 == 0 ? 2 : 1)) % 3] = 3 * a + i;
            cell[(axis + (face % 2 == 0 ? 1 : 2)) % 3] = 3 * b + j;
            glm::vec3 p = glm::vec3(cell) * (2.0f / float(last)) - 1.0f;
            p = p * (1.2f / glm::length(p)) + 0.1f * p;
            p += lattice[(cell.z * (last + 1) + cell.y) * (last + 1) + cell.x];
            if (isPinched && cell.x == 0 && cell.y == 0)
              p = 0.01f * p - glm::vec3(1, 1, 0);
            patch.points[4 * i + j] = p;
          }
        patches.push_back(turned(patch, int(random() % 4)));
        patches.back().index = int(patches.size()) - 1;
      }
  return patches;
}

/// Keeps the micropolygons.
struct Collect : piko::Stage<0, 0, 1, Micropolygon> {
  std::vector<Micropolygon> *micropolygons = nullptr;
  void process(const Micropolygon &m) { micropolygons->push_back(m); }
};

struct DicePipe : piko::Pipe<State> {
  Load load;
  Split split;
  Dice dice;
  Collect collect;

  DicePipe() {
    source(load);
    connect(load, 0, split);
    connect(split, 0, split);
    connect(split, 1, dice);
    connect(dice, 0, collect);
    allocateForSource(state().undrawn, 0);
  }
};

struct ReyesTest : testing::Test {
  static constexpr glm::ivec2 size{160, 120};
  Patches patches;
  Camera camera;
  float rate = 1;
  std::vector<Light> lights{{{0, 0, 1, 0}, {1, 1, 1, 0}}};
  Reyes pipe;

  /// A camera at `eye`, which looks at `at`.
  void look(glm::vec3 eye, glm::vec3 at = {0, 0, 0}, float fovy = 45) {
    ViewOptions options{
        .width = size.x, .height = size.y, .fovy = fovy, .eye = eye, .at = at};
    Mesh mesh;
    mesh.patches = patches;
    camera = *makeCamera(options, boundingSphere(mesh));
  }

  /// Moves the near plane.
  void setNear(float nearZ) {
    camera.nearZ = nearZ;
    float depth = camera.farZ - nearZ, scale = (camera.farZ + nearZ) / depth;
    glm::vec3 z = scale * camera.forward;
    for (int i = 0; i < 3; ++i)
      camera.viewProjection[i].z = z[i];
    camera.viewProjection[3].z =
        -glm::dot(z, camera.eye) - 2 * camera.farZ * nearZ / depth;
  }

  template <class Pipe> void run(Pipe &pipe) {
    for (size_t i = 0; i < patches.size(); ++i)
      patches[i].index = int(i);
    pipe.setDomain(size);
    pipe.state().camera = camera;
    pipe.state().rate = rate;
    pipe.state().lights.bind(lights.data(), int64_t(lights.size()));
    pipe.state().patches.bind(patches.data(), int64_t(patches.size()));
    pipe.feed(pipe.load, patches);
    pipe.run();
  }
  void run() { run(pipe); }

  std::vector<Micropolygon> dice() {
    std::vector<Micropolygon> micropolygons;
    DicePipe pipe;
    pipe.collect.micropolygons = &micropolygons;
    run(pipe);
    return micropolygons;
  }

  int countDrawn() {
    const Color *first = pipe.state().color.data();
    return int(std::count_if(first, first + size.x * size.y,
                             [](const Color &c) { return c.rgba.a != 0; }));
  }
  int countUndrawn() {
    int sum = 0;
    for (size_t i = 0; i < patches.size(); ++i)
      sum += pipe.state().undrawn[int64_t(i)].count;
    return sum;
  }

  int countCracks(int cells) {
    FineTessellation fine(camera, size.x, size.y);
    for (const Patch &patch : patches)
      fine.add(patch, cells);
    EXPECT_GT(fine.countCovered(), 500);
    std::vector<float> depths;
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x)
        depths.push_back(pipe.state().depth({x, y}).z);
    return fine.countCracks(depths);
  }
};

uint32_t bitsOf(float x) { return std::bit_cast<uint32_t>(x); }

TEST_F(ReyesTest, ReversedCurvesAreTheSameBits) {
  patches = makeLump(1, 0.2f, 1);
  look({0, 0, 4});
  View view(camera, size, 1);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> coordinate(-1, 1);
  for (int n = 0; n < 1000; ++n) {
    Curve c, reversed;
    for (int k = 0; k < 4; ++k)
      c.points[k] = {coordinate(random), coordinate(random),
                     coordinate(random)};
    for (int k = 0; k < 4; ++k)
      reversed.points[k] = c.points[3 - k];
    Parameter a = Parameter(random() % whole);
    Parameter b = a + Parameter(random() % unsigned(whole - a));
    Curve part = partOf(c, a, b);
    Curve back = partOf(reversed, whole - b, whole - a);
    for (int k = 0; k < 4; ++k)
      for (int i = 0; i < 3; ++i)
        EXPECT_EQ(bitsOf(part.points[k][i]), bitsOf(back.points[3 - k][i]));
    EXPECT_EQ(segmentsOf(part, view), segmentsOf(back, view));
  }
}

// A closed surface has as many fronts as backs in each pixel, exactly, if and
// only if its micropolygons leave no gap and no overlap.
TEST_F(ReyesTest, ClosedSurfacesStayClosed) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> coordinate(-1, 1);
  int covered = 0;
  for (int n = 0; n < 24; ++n) {
    bool isPinched = n >= 12;
    patches = makeLump(1 + n % 3, 0.05f * float(n % 5), unsigned(n), isPinched);
    rate = std::exp2(float(n % 7) - 2);
    glm::vec3 direction(coordinate(random), coordinate(random),
                        coordinate(random));
    glm::vec3 eye = direction * (2.6f / glm::length(direction));
    if (isPinched) // closely at that edge
      look({-1.8f, -1.9f, coordinate(random)}, {-1, -1, 0}, 5);
    else
      look(eye, {0.5f * coordinate(random), 0.5f * coordinate(random), 0},
           n % 4 == 0 ? 5.0f : 45.0f);
    std::vector<int> signs(size.x * size.y), counts = signs;
    for (const Micropolygon &m : dice())
      for (int part : {1, 2}) {
        Point a = m.corners[0], b = m.corners[part], c = m.corners[part + 1];
        int64_t area = raster::signedArea(a, b, c);
        if (area == 0)
          continue;
        raster::Edges edges(a, area > 0 ? b : c, area > 0 ? c : b);
        PixelBox box = Dice::boxOf(m);
        for (int y = std::max(box.lo.y, 0); y <= std::min(box.hi.y, size.y - 1);
             ++y)
          for (int x = std::max(box.lo.x, 0);
               x <= std::min(box.hi.x, size.x - 1); ++x)
            if (edges.cover(x, y)) {
              signs[y * size.x + x] += area > 0 ? 1 : -1;
              ++counts[y * size.x + x];
            }
      }
    EXPECT_EQ(std::count(signs.begin(), signs.end(), 0), size.x * size.y)
        << "lump " << n;
    covered +=
        int(size.x * size.y - std::count(counts.begin(), counts.end(), 0));
  }
  EXPECT_GT(covered, 24 * 2000);
}

TEST_F(ReyesTest, LeavesNoCracks) {
  for (float pixels : {0.5f, 1.0f, 3.0f})
    for (glm::vec3 eye : {glm::vec3(0, 0, 3), glm::vec3(2, 1, 1.5f),
                          glm::vec3(0.3f, -2.5f, -0.2f)}) {
      patches = makeLump(2, 0.1f, 5);
      rate = pixels;
      look(eye);
      run();
      EXPECT_EQ(countUndrawn(), 0);
      EXPECT_EQ(countCracks(256), 0) << "rate " << rate;
    }
}

// Those at borders may have moved by half a segment at both ends.
TEST_F(ReyesTest, EdgesAreAsShortAsAsked) {
  patches = makeLump(2, 0.1f, 5);
  look({0, 0, 3});
  for (float pixels : {0.5f, 1.0f, 5.0f}) {
    rate = pixels;
    size_t within = 0, all = 0;
    for (const Micropolygon &m : dice())
      for (int k = 0; k < 4; ++k) {
        Point a = m.corners[k], b = m.corners[(k + 1) % 4];
        double length = std::hypot(a.x - b.x, a.y - b.y) / raster::subpixels;
        EXPECT_LT(length, 2 * rate + 0.01);
        within += length <= rate + 0.01;
        ++all;
      }
    EXPECT_GT(double(within), 0.98 * double(all));
  }
}

TEST_F(ReyesTest, SmoothNormalsFaceTheEye) {
  // A patch in the plane z = 0, from both sides.
  for (float z : {3.0f, -3.0f}) {
    patches = {patchOf(
        [](float u, float v) { return glm::vec3(2 * u - 1, 2 * v - 1, 0); })};
    look({0, 0, z});
    auto micropolygons = dice();
    EXPECT_GT(micropolygons.size(), 1000u);
    for (const Micropolygon &m : micropolygons) {
      EXPECT_NEAR(m.normal.z, z / 3, 1e-6f);
      EXPECT_NEAR(m.position.z, 0, 1e-6f);
    }
  }
}

TEST_F(ReyesTest, ShadesTheNearest) {
  // A square before another, and one after both.
  for (float z : {0.0f, 1.0f, -1.0f})
    patches.push_back(patchOf([z](float u, float v) {
      return glm::vec3(u - 0.5f, v - 0.5f, z) * (z == 1 ? 0.5f : 1.0f);
    }));
  lights[0].position = {0, 0, 9, 1};
  rate = 0.5f;
  look({0, 0, 4});
  run();
  Color center = pipe.state().color({size.x / 2, size.y / 2});
  EXPECT_NEAR(center.rgba.x, 0.8f * 1.05f, 1e-3f);
  glm::vec4 clip = camera.viewProjection * glm::vec4(0, 0, 0.5f, 1);
  EXPECT_NEAR(pipe.state().depth({size.x / 2, size.y / 2}).z, clip.z / clip.w,
              1e-5f);
  EXPECT_EQ(pipe.state().color({0, 0}).rgba.a, 0);
}

// As in the lid of the teapot: one edge is a point.
TEST_F(ReyesTest, CollapsedEdges) {
  for (int k = 0; k < 4; ++k) {
    float from = float(M_PI) / 2 * float(k);
    patches.push_back(turned(patchOf([from](float u, float v) {
                               float angle = from + float(M_PI) / 2 * v;
                               return glm::vec3(std::cos(angle) * u,
                                                std::sin(angle) * u, 1 - u * u);
                             }),
                             k));
  }
  for (glm::vec3 eye : {glm::vec3(0, 0, 3), glm::vec3(1, -2, 1)}) {
    look(eye);
    run();
    EXPECT_EQ(countUndrawn(), 0);
    EXPECT_EQ(countCracks(256), 0);
    for (int i = 0; i < size.x * size.y; ++i)
      EXPECT_TRUE(glm::all(
          glm::lessThan(pipe.state().color.data()[i].rgba, glm::vec4(2))));
  }
}

TEST_F(ReyesTest, LinesAndPointsDrawNothing) {
  patches = {
      patchOf([](float u, float v) { return glm::vec3(u + v, 0.1f, 0); }),
      patchOf([](float, float) { return glm::vec3(0.1f); })};
  look({0, 0, 3});
  run();
  EXPECT_EQ(countDrawn(), 0);
  EXPECT_EQ(countUndrawn(), 0);
}

TEST_F(ReyesTest, TinyPatches) {
  patches = makeLump(1, 0, 1);
  look({0, 0, 4});
  for (Patch &patch : patches)
    for (glm::vec3 &p : patch.points)
      p *= 1e-4f;
  auto micropolygons = dice();
  EXPECT_LE(micropolygons.size(), 6u);
}

TEST_F(ReyesTest, LeavesOutWhatIsBehindTheEye) {
  patches = makeLump(1, 0.1f, 1);
  look({0, 0, 4}, {0, 0, 8});
  run();
  EXPECT_EQ(countDrawn(), 0);
  EXPECT_EQ(countUndrawn(), 0);
}

/// A level ground about the origin.
Patch makeGround(float reach) {
  return patchOf([=](float u, float v) {
    return glm::vec3(reach * (2 * u - 1), -1, reach * (2 * v - 1));
  });
}

// From in front of the eye to far behind it; the lower half of the picture is
// full.
TEST_F(ReyesTest, PatchesThroughTheEyePlane) {
  for (float reach : {3.0f, 100.0f, 1e4f}) {
    patches = {makeGround(reach)};
    look({0, 0, 0}, {0, -0.5f, -1}, 60);
    setNear(0.01f);
    run();
    EXPECT_EQ(countUndrawn(), 0);
    if (reach < 10)
      EXPECT_EQ(countCracks(3000), 0);
    for (int x = 0; x < size.x; ++x)
      EXPECT_EQ(pipe.state().color({x, size.y - 1}).rgba.a, 1)
          << "reach " << reach << ", x " << x;
  }
}

// Near the eye, a step of the parameter is far longer than a pixel.
TEST_F(ReyesTest, ReportsWhatIsTooLarge) {
  patches = {makeGround(1e9f)};
  look({0, 0, 0}, {0, -0.5f, -1}, 60);
  setNear(0.01f);
  run();
  EXPECT_GT(countUndrawn(), 0);
}

// Halving does not help where the near plane is as good as in the eye.
TEST_F(ReyesTest, ReportsWhatItCannotSplit) {
  patches = {patchOf(
      [](float u, float v) { return glm::vec3(2 * u - 1, 0, 2 * v - 1); })};
  look({0, 0, 0}, {0, -0.1f, -1}, 60);
  setNear(1e-30f);
  run();
  EXPECT_GT(countUndrawn(), 0);
  EXPECT_LT(countUndrawn(), 1000);
}

TEST_F(ReyesTest, ReportsControlPointsThatAreNoNumbers) {
  patches = makeLump(1, 0.1f, 1);
  look({0, 0, 4});
  patches[1].points[7].y = NAN;
  patches[3].points[15].z = INFINITY;
  patches[4].points[0].x = 1e30f;
  run();
  EXPECT_GT(countDrawn(), 0);
  for (int i = 0; i < 6; ++i)
    EXPECT_EQ(pipe.state().undrawn[i].count, i == 1 || i == 3 || i == 4);
}

} // namespace
