//===- RayTriangles.cpp - Rays through edges, corners and needles ---------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Cast.h"
#include "Failure.h"

#include "MollerTrumboreRays.h"
#include "WatertightRays.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace failures {
namespace {

using piko::scene::BvhTriangle;

struct Ray {
  glm::vec3 origin, direction;
};
struct Scene {
  std::vector<BvhTriangle> triangles;
  std::vector<Ray> rays;

  void add(glm::vec3 a, glm::vec3 b, glm::vec3 c) {
    triangles.push_back({{{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}},
                         int32_t(triangles.size())});
  }
};

/// For each ray whether it meets nothing.
template <class Pipe> std::vector<bool> findMisses(const Scene &scene) {
  std::vector<typename Pipe::Query> queries;
  for (const Ray &ray : scene.rays)
    queries.push_back({ray.origin, ray.direction, int32_t(queries.size())});
  Pipe pipe;
  pipe.setDomain({1, 1});
  pipe.state().triangles.assign(
      castAll<typename Pipe::BvhTriangle>(scene.triangles));
  pipe.feed(pipe.find, queries);
  pipe.run().orThrow();
  std::vector<bool> misses;
  for (size_t i = 0; i < queries.size(); ++i)
    misses.push_back(pipe.state().answers[int64_t(i)].triangle < 0);
  return misses;
}

template <class Pipe> double countMisses(const Scene &scene) {
  std::vector<bool> misses = findMisses<Pipe>(scene);
  return double(std::count(misses.begin(), misses.end(), true));
}

Errors compare(const Scene &scene) {
  return {countMisses<pipelines::MollerTrumboreRays>(scene),
          countMisses<pipelines::WatertightRays>(scene)};
}

constexpr const char *naive = "Moller and Trumbore's test in floats";
constexpr const char *ours = "watertight test";

/// A sphere of so many rings about the eye, and rays at points of its edges
/// and at its corners.
Scene makeSphere(int rings, int rayCount) {
  Scene scene;
  int around = 2 * rings;
  auto point = [&](int i, int j) {
    double polar = M_PI * i / rings, angle = 2 * M_PI * (j % around) / around;
    if (i == rings) // one point for all j
      polar = M_PI, angle = 0;
    return glm::vec3(std::sin(polar) * std::cos(angle), std::cos(polar),
                     std::sin(polar) * std::sin(angle));
  };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      if (i > 0)
        scene.add(point(i, j), point(i, j + 1), point(i + 1, j));
      if (i + 1 < rings)
        scene.add(point(i, j + 1), point(i + 1, j + 1), point(i + 1, j));
    }
  const glm::vec3 eye(0.1f, 0.2f, -0.3f);
  std::mt19937 random(1);
  for (int n = 0; n < rayCount; ++n) {
    const BvhTriangle &t = scene.triangles[random() % scene.triangles.size()];
    int edge = int(random() % 3);
    float share = n % 8 == 0 ? 0 : float(random() % 1000) / 1000;
    const float *a = t.corner[edge], *b = t.corner[(edge + 1) % 3];
    glm::vec3 from(a[0], a[1], a[2]), to(b[0], b[1], b[2]);
    scene.rays.push_back({eye, from + (to - from) * share - eye});
  }
  return scene;
}

/// A rough sheet that fills a picture whose rays meet many of its edges and
/// corners: these are on the centres of pixels.
Scene makeSheet(int size) {
  constexpr int cell = 8;
  Scene scene;
  auto direction = [=](int x, int y) {
    return glm::vec3((x + 0.5f) / size - 0.5f, 0.5f - (y + 0.5f) / size, -1);
  };
  auto corner = [=](int i, int j) {
    float depth = 3 + float((i * 7 + j * 11) % 13) / 13;
    return depth * direction(i * cell, j * cell);
  };
  for (int j = 0; j < size / cell; ++j)
    for (int i = 0; i < size / cell; ++i) {
      scene.add(corner(i, j), corner(i, j + 1), corner(i + 1, j));
      scene.add(corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
    }
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      scene.rays.push_back({glm::vec3(0), direction(x, y)});
  return scene;
}

template <class Pipe> Image drawSheet(int size) {
  std::vector<bool> misses = findMisses<Pipe>(makeSheet(size));
  return paint(size, size, [&](int x, int y) {
    return misses[y * size + x] ? rgb(1, 0.1f, 0.1f) : rgb(0.8f, 0.8f, 0.8f);
  });
}

struct RayLeaks : Mode {
  static constexpr int rays = 20000;
  Description describe() const override {
    return {"RayLeaks",
            "Rays through edges and corners of a closed mesh",
            "rings of a sphere",
            "rays of 20,000 that leak",
            naive,
            ours,
            {4, 6, 8, 12, 16, 24}};
  }
  Errors measure(double rings) const override {
    return compare(makeSphere(int(rings), rays));
  }
  Pictures draw() const override {
    return {drawSheet<pipelines::MollerTrumboreRays>(128),
            drawSheet<pipelines::WatertightRays>(128)};
  }
};
const Registration<RayLeaks> leaks;

TEST(Failure, RayLeaks) {
  for (int rings : {4, 12}) {
    Errors errors = RayLeaks().measure(rings);
    EXPECT_GT(errors.naive, 20) << rings;
    EXPECT_EQ(errors.ours, 0) << rings;
  }
}

/// A square at distance 1, of needles from bottom to top, `width` wide each,
/// and rays at the inside of each.
struct RayNeedles : Mode {
  static constexpr int needles = 128, middle = needles / 2, raysEach = 16;
  static Scene makeScene(double width) {
    Scene scene;
    auto at = [&](int i) { return float(width * (i - middle)); };
    for (int i = 0; i < needles; ++i) {
      scene.add({at(i), -1, -1}, {at(i + 1), -1, -1}, {at(i), 1, -1});
      scene.add({at(i + 1), -1, -1}, {at(i + 1), 1, -1}, {at(i), 1, -1});
      for (int j = 0; j < raysEach; ++j) {
        float y = 1.8f * (float(j) + 0.5f) / raysEach - 0.9f;
        scene.rays.push_back(
            {{0, 0, 0}, {float(width * (i - middle + 0.37)), y, -1}});
      }
    }
    return scene;
  }
  Description describe() const override {
    return {"RayNeedles",
            "Rays at the inside of needles",
            "width of a needle, which is 2 long",
            "rays of 2048 that meet nothing",
            naive,
            ours,
            {1e-2, 1e-4, 1e-6, 1e-7, 1e-8, 1e-12, 1e-20}};
  }
  Errors measure(double width) const override {
    return compare(makeScene(width));
  }
};
const Registration<RayNeedles> needles;

TEST(Failure, RayNeedles) {
  for (double width : {1e-8, 1e-20}) {
    Errors errors = RayNeedles().measure(width);
    EXPECT_EQ(errors.naive, 2048) << width;
    EXPECT_EQ(errors.ours, 0) << width;
  }
}

} // namespace
} // namespace failures
