//===- ShadowTest.cpp - The shadow map under the reference executor -------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "raster/raster.piko.cpp"
#include "shadow/shadow.piko.cpp"

#include "TestScene.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace test;

constexpr int width = 101, height = 67; // no multiples of a bin's extent

template <class Pipeline> Picture render(const Input &input) {
  Pipeline pipeline;
  pipeline.setDomain({width, height});
  pipeline.state().camera = makeCamera();
  pipeline.state().settings = input.settings;
  pipeline.state().lights.assign(input.lights);
  if constexpr (requires { pipeline.fit; }) {
    pipeline.feed(pipeline.fit, input.vertices);
    pipeline.feed(pipeline.project, input.triangles);
  }
  feedMesh(pipeline, input);
  pipeline.run();
  return copy(pipeline.state().color);
}

/// The ray through the centre of a pixel.
glm::vec3 rayThrough(int x, int y) {
  Camera camera = makeCamera();
  float sx = 2 * (x + 0.5f) / width - 1, sy = 1 - 2 * (y + 0.5f) / height;
  return camera.forward + camera.right * sx + camera.up * sy;
}

void addQuad(Input &input, glm::vec3 center, glm::vec3 u, glm::vec3 v) {
  glm::vec3 normal = glm::normalize(glm::cross(u, v));
  int corner[] = {input.addVertex(center - u - v, normal),
                  input.addVertex(center + u - v, normal),
                  input.addVertex(center + u + v, normal),
                  input.addVertex(center - u + v, normal)};
  input.addTriangle(corner[0], corner[1], corner[2]);
  input.addTriangle(corner[0], corner[2], corner[3]);
}

Light makeSun(glm::vec3 toLight) {
  return {glm::vec4(glm::normalize(toLight), 0), {1, 1, 1, 0}};
}

TEST(Shadow, BinsDoNotChangeIt) {
  Input input = makeSoup(300);
  Picture whole = render<shadow::WholeScreen>(input);
  EXPECT_FALSE(equal(whole, render<Binned>(input))); // there are shadows
  EXPECT_TRUE(equal(whole, render<shadow::Bins8>(input)));
  EXPECT_TRUE(equal(whole, render<shadow::Bins16>(input)));
  EXPECT_TRUE(equal(whole, render<shadow::Bins32>(input)));
  EXPECT_TRUE(equal(whole, render<shadow::MapBins32>(input)));
}

TEST(Shadow, OnlyDirectionsCastThem) {
  Input input = makeSoup(100);
  input.lights = {{{1, 2, 3, 1}, {0.2f, 0.3f, 0.4f, 0}}};
  EXPECT_TRUE(equal(render<shadow::Bins8>(input), render<Binned>(input)));
  input.lights.clear();
  EXPECT_TRUE(equal(render<shadow::Bins8>(input), render<Binned>(input)));
}

// No acne: a plane is lit as without shadows, from any side and at any angle.
TEST(Shadow, PlaneDoesNotShadeItself) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> d(-1, 1);
  int lit = 0;
  for (int i = 0; i < 60; ++i) {
    glm::vec3 normal =
        glm::normalize(glm::vec3(d(random), d(random), 0.2f + d(random) + 1));
    glm::vec3 u = glm::normalize(glm::cross(normal, {0.3f, 1, 0}));
    glm::vec3 v = glm::cross(normal, u);
    glm::vec3 aside = std::cos(float(i)) * u + std::sin(float(i)) * v;
    float angle = i % 10 * 0.172f; // up to 89 degrees
    Input input;
    addQuad(input, {0, 0, -5}, 4.0f * u, 3.0f * v);
    input.lights = {
        makeSun(normal * std::cos(angle) + aside * std::sin(angle))};
    Picture expected = render<Binned>(input);
    Picture picture = render<shadow::Bins8>(input);
    for (size_t p = 0; p < picture.size(); ++p) {
      lit += expected[p].rgba.r > 0.05f && expected[p].rgba.a > 0;
      ASSERT_LT(glm::distance(picture[p].rgba, expected[p].rgba), 1e-5f)
          << "plane " << i << ", pixel " << p % width << ", " << p / width;
    }
  }
  EXPECT_GT(lit, 50000);
}

/// A floor and something that stands on it or floats above it. The map's
/// texels are smaller than `texel`.
struct ShadowOnFloor : testing::Test {
  static constexpr float floorY = -1, texel = 0.25f;
  glm::vec3 toLight = glm::normalize(glm::vec3(0.6f, 1, -0.3f));
  Input input;

  void SetUp() override {
    addQuad(input, {0, floorY, -6}, {0, 0, 6}, {6, 0, 0});
    input.lights = {makeSun(toLight)};
  }

  /// Compares each pixel that shows the floor with isDark(point, margin), which
  /// says whether the light is hidden from all (1) or none (-1) of the points
  /// within the margin.
  template <class IsDark> void expectShadow(IsDark isDark) {
    Picture lit = render<Binned>(input),
            picture = render<shadow::Bins16>(input);
    int dark = 0, bright = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        glm::vec3 ray = rayThrough(x, y);
        if (ray.y >= 0)
          continue;
        glm::vec3 point = ray * (floorY / ray.y);
        if (std::abs(point.x) > 5.9f || std::abs(point.z + 6) > 5.9f)
          continue;
        float color = picture[y * width + x].rgba.r;
        int state = isDark(point, 4 * texel);
        if (state > 0) {
          ++dark;
          EXPECT_NEAR(color, 0.8f * 0.05f, 1e-6f) << x << ", " << y;
        } else if (state < 0) {
          ++bright;
          EXPECT_NEAR(color, lit[y * width + x].rgba.r, 1e-5f)
              << x << ", " << y;
        }
      }
    EXPECT_GT(dark, 20);
    EXPECT_GT(bright, 500);
  }
};

TEST_F(ShadowOnFloor, LiesWhereTheLightIsHidden) {
  glm::vec3 center(0.5f, 2.5f, -6);
  addQuad(input, center, {0, 0, 2}, {2, 0, 0}); // above the view
  expectShadow([&](glm::vec3 point, float margin) {
    glm::vec3 hit = point + toLight * ((center.y - floorY) / toLight.y);
    float beyond =
        std::max(std::abs(hit.x - center.x), std::abs(hit.z - center.z)) - 2;
    return beyond < -margin ? 1 : beyond > margin ? -1 : 0;
  });
}

// No peter-panning: the shadow of a wall begins at its foot.
TEST_F(ShadowOnFloor, BeginsAtTheFoot) {
  addQuad(input, {1, 1, -6}, {0, 0, 3}, {0, 2, 0});
  expectShadow([&](glm::vec3 point, float margin) {
    float after = 1 - point.x; // away from the light
    float z = point.z + toLight.z / toLight.x * after;
    float beyond = std::abs(z + 6) - 3;
    if (after < -0.01f)
      return point.x > 1 + margin ? -1 : 0;
    float rise = after * toLight.y / toLight.x; // of the light that passes
    if (beyond < -margin && after > 0.6f * margin && rise < 4 - margin)
      return 1;
    return beyond > margin || rise > 4 + margin ? -1 : 0;
  });
}

} // namespace
