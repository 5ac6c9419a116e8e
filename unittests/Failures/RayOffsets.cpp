//===- RayOffsets.cpp - Surfaces that shadow themselves -------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A shadow ray that begins within the rounding errors of its surface may meet
// it again (acne); one that begins too far from it may be past what casts the
// shadow.
#include "Cast.h"
#include "Failure.h"

#include "ExampleRays.h"
#include "FixedOffsetRays.h"

#include "Piko/Scene/Bvh.h"

#include <cmath>

namespace failures {
namespace {

constexpr int size = 128;

/// A tilted ground, a square above it, and a light, in a frame of their own.
/// y is up, and the camera looks down from y = 6.
class ShadowScene {
public:
  piko::render::Mesh mesh;

  ShadowScene(double scale, double away) : scale(scale), away(away) {
    addSquare(8, 0);
    addSquare(1.5, 1);
  }

  glm::dvec3 direction(glm::dvec3 d) const {
    const glm::dmat3 frame(glm::dvec3(0.8, 0.36, 0.48),
                           glm::dvec3(-0.6, 0.48, 0.64),
                           glm::dvec3(0, -0.8, 0.6));
    return frame * d;
  }
  glm::vec3 place(glm::dvec3 p) const {
    return direction(p) * scale + glm::dvec3(away, away, -away);
  }

  piko::scene::Camera camera() const {
    piko::scene::Camera c{};
    c.eye = place({0, 6, 0});
    c.forward = direction({0, -1, 0});
    c.right = direction({reach, 0, 0});
    c.up = direction({0, 0, -reach});
    return c;
  }
  glm::dvec3 toLight() const { return direction(light); }

  /// Whether a pixel's colour is to be that in the light; it is not to be
  /// asked for one that sees the square, or the shadow's edge.
  static bool isLit(int x, int y) { return !isUnder(groundAt(x, y), 1.5); }
  static bool isClear(int x, int y) {
    glm::dvec2 p = groundAt(x, y);
    double pixel = 12 * reach / size, margin = 2 * pixel;
    bool seesSquare =
        std::max(std::abs(p.x), std::abs(p.y)) < 1.5 * 6 / 5 + margin;
    return !seesSquare && isUnder(p, 1.5 + margin) == isUnder(p, 1.5 - margin);
  }

private:
  static constexpr double reach = 0.7;
  static constexpr glm::dvec3 light{0.64, 0.48, 0.6};

  static glm::dvec2 groundAt(int x, int y) {
    return 6 * reach *
           glm::dvec2((x + 0.5) * 2 / size - 1, (y + 0.5) * 2 / size - 1);
  }
  /// Whether the ray to the light meets a square of that half width.
  static bool isUnder(glm::dvec2 p, double half) {
    glm::dvec2 above = p + glm::dvec2(light.x, light.z) / light.y;
    return std::max(std::abs(above.x), std::abs(above.y)) < half;
  }

  void addSquare(double half, double y) {
    int first = int(mesh.vertices.size());
    for (int i = 0; i < 4; ++i) {
      double x = i == 0 || i == 3 ? -half : half, z = i < 2 ? half : -half;
      mesh.vertices.push_back(
          {place({x, y, z}), direction({0, 1, 0}), first + i});
    }
    for (int i = 1; i < 3; ++i)
      mesh.triangles.push_back(
          {{first, first + i, first + i + 1}, int32_t(mesh.triangles.size())});
  }

  double scale, away;
};

template <class Pipe> Image drawShadow(const ShadowScene &scene) {
  auto tree = piko::render::buildBvh(scene.mesh);
  EXPECT_TRUE(tree);
  Pipe pipe;
  pipe.setDomain({size, size});
  auto &state = pipe.state();
  state.camera = std::bit_cast<typename Pipe::Camera>(scene.camera());
  state.depth = 0;
  state.bounds = std::bit_cast<typename Pipe::Bounds>(tree->bounds);
  state.nodes.assign(castAll<typename Pipe::BvhNode>(tree->nodes));
  state.leaves.assign(castAll<typename Pipe::BvhTriangle>(tree->triangles));
  state.triangles.assign(
      castAll<typename Pipe::Triangle>(scene.mesh.triangles));
  state.vertices.assign(castAll<typename Pipe::Vertex>(scene.mesh.vertices));
  std::vector<typename Pipe::Light> lights{
      {glm::vec4(scene.toLight(), 0), {1.5f, 1.5f, 1.5f, 0}}};
  state.lights.assign(lights);
  std::vector<typename Pipe::Nothing> nothing;
  pipe.feed(pipe.primary, nothing);
  pipe.run().orThrow();
  auto image = state.image.view();
  return paint(size, size, [&](int x, int y) {
    return std::bit_cast<piko::scene::Color>(image(x, y));
  });
}

double countWrong(const Image &image) {
  int wrong = 0;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      if (ShadowScene::isClear(x, y)) {
        float exact = 0.8f * (ShadowScene::isLit(x, y) ? 0.05f + 0.72f : 0.05f);
        float color = image.pixels[y * size + x].rgba.x;
        wrong += !(std::abs(color - exact) < 0.01f);
      }
  return wrong;
}

Errors compare(const ShadowScene &scene) {
  return {countWrong(drawShadow<pipelines::FixedOffsetRays>(scene)),
          countWrong(drawShadow<pipelines::ExampleRays>(scene))};
}

Pictures show(const ShadowScene &scene) {
  return {drawShadow<pipelines::FixedOffsetRays>(scene),
          drawShadow<pipelines::ExampleRays>(scene)};
}

constexpr const char *naive = "begin 0.0001 from the surface";
constexpr const char *ours = "begin where rounding ends";

struct RaySelfIntersection : Mode {
  Description describe() const override {
    return {"RaySelfIntersection",
            "Shadow rays in small and large scenes",
            "height of what casts a shadow",
            "wrong pixels",
            naive,
            ours,
            {1e-12, 1e-6, 1e-4, 1e-2, 1, 1e4, 1e6, 1e10}};
  }
  Errors measure(double scale) const override { return compare({scale, 0}); }
  Pictures draw() const override { return show({1e4, 0}); }
};
const Registration<RaySelfIntersection> selfIntersection;

TEST(Failure, RaySelfIntersection) {
  for (double scale : {1e-6, 1e6}) {
    Errors errors = RaySelfIntersection().measure(scale);
    EXPECT_GT(errors.naive, 500) << scale;
    EXPECT_EQ(errors.ours, 0) << scale;
  }
}

struct RayFarAway : Mode {
  Description describe() const override {
    return {"RayFarAway",
            "Shadow rays far from the origin",
            "distance of the scene along each axis, 16 wide",
            "wrong pixels",
            naive,
            ours,
            {0, 1e2, 1e3, 3e3, 1e4, 3e4, 1e5}};
  }
  Errors measure(double away) const override { return compare({1, away}); }
  Pictures draw() const override { return show({1, 1e4}); }
};
const Registration<RayFarAway> farAway;

TEST(Failure, RayFarAway) {
  Errors errors = RayFarAway().measure(1e4);
  EXPECT_GT(errors.naive, 500);
  EXPECT_EQ(errors.ours, 0);
}

} // namespace
} // namespace failures
