//===- PictureTest.cpp - The rasterizer under the reference executor ------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "raster/raster.piko.cpp"

#include "../Examples/TestScene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace {

using namespace test;

template <class Pipeline> Picture render(Input &input, int w, int h) {
  Pipeline pipeline;
  pipeline.setDomain({w, h});
  pipeline.state().camera = makeCamera();
  pipeline.state().settings = input.settings;
  pipeline.state().lights.assign(input.lights);
  feedMesh(pipeline, input);
  pipeline.run();
  return copy(pipeline.state().color);
}

TEST(Picture, TheMappingDoesNotChangeIt) {
  for (bool cull : {false, true}) {
    Input input = makeSoup(600);
    input.settings.cullBackFaces = cull;
    // Neither extent is a multiple of a bin's.
    auto baseline = render<Baseline>(input, 203, 101);
    EXPECT_TRUE(equal(baseline, render<FreePipe>(input, 203, 101)));
    EXPECT_TRUE(equal(baseline, render<Binned>(input, 203, 101)));
    EXPECT_TRUE(equal(baseline, render<BinnedFused>(input, 203, 101)));
    EXPECT_TRUE(equal(baseline, render<Bucketed>(input, 203, 101)));
    EXPECT_TRUE(equal(baseline, render<Indexed>(input, 203, 101)));
    EXPECT_TRUE(equal(baseline, render<Fused>(input, 203, 101)));
    EXPECT_TRUE(equal(baseline, render<Tiled>(input, 203, 101)));
  }
}

TEST(Picture, BackgroundStaysWhereNothingIsDrawn) {
  Input input;
  auto pixels = render<Binned>(input, 20, 12);
  for (const Color &pixel : pixels)
    EXPECT_EQ(pixel.rgba, Color{}.rgba);
}

TEST(Picture, ShadesByTheFormula) {
  Input input;
  addSquare(input, {0, 0}, 4, 2, glm::normalize(glm::vec3(0.3f, 0.2f, 1)));
  input.lights = {{{0.48f, 0.6f, 0.64f, 0}, {0.5f, 0.4f, 0.3f, 0}},
                  {{1, 1, -1, 1}, {0.1f, 0.2f, 0.3f, 0}},
                  {{0, 0, -9, 1}, {9, 9, 9, 0}}}; // after the square
  const int side = 16;
  auto pixels = render<Baseline>(input, side, side);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      glm::dvec3 p(2 * (2 * (x + 0.5) / side - 1),
                   2 * (1 - 2 * (y + 0.5) / side), -2);
      glm::dvec3 n = glm::normalize(glm::dvec3(0.3, 0.2, 1));
      glm::dvec3 sum(0.05);
      for (const Light &light : input.lights) {
        glm::dvec3 l =
            glm::dvec3(light.position) - double(light.position.w) * p;
        sum += glm::dvec3(light.color) *
               (std::max(0.0, glm::dot(n, l)) / glm::length(l));
      }
      const glm::vec4 &color = pixels[y * side + x].rgba;
      EXPECT_NEAR(color.r, 0.8 * sum.r, 1e-5);
      EXPECT_NEAR(color.g, 0.8 * sum.g, 1e-5);
      EXPECT_NEAR(color.b, 0.8 * sum.b, 1e-5);
      EXPECT_EQ(color.a, 1);
    }
}

TEST(Picture, NearerSurfaceWinsInAnyOrder) {
  for (bool nearFirst : {false, true}) {
    Input input;
    input.lights = {{{0, 0, 1, 0}, {1, 1, 1, 0}}};
    for (bool isNear : {nearFirst, !nearFirst})
      addSquare(input, {0, 0}, isNear ? 1 : 30, isNear ? 2 : 4,
                isNear ? glm::vec3(0, 0, 1) : glm::vec3(0, 0, -1));
    auto pixels = render<Binned>(input, 32, 32);
    EXPECT_NEAR(pixels[16 * 32 + 16].rgba.g, 0.8f * 1.05f, 1e-5f);
    EXPECT_NEAR(pixels[2 * 32 + 16].rgba.g, 0.8f * 0.05f, 1e-5f);
  }
}

// Of two surfaces at the same depth, the one that comes first stays.
TEST(Picture, FirstOfEqualDepthStays) {
  Input input;
  input.lights = {{{0, 0, 1, 0}, {1, 1, 1, 0}}};
  addSquare(input, {0, 0}, 4, 2, {0, 0, 1});
  addSquare(input, {0, 0}, 4, 2, {0, 0, -1});
  auto pixels = render<Binned>(input, 16, 16);
  for (const Color &pixel : pixels)
    EXPECT_NEAR(pixel.rgba.g, 0.8f * 1.05f, 1e-5f);
}

// A floor that passes below the camera fills the image up to the horizon.
TEST(Picture, ClipsAtTheNearPlane) {
  Input input;
  int a = input.addVertex({-900, -1, 50}, {0, 1, 0});
  int b = input.addVertex({900, -1, 50}, {0, 1, 0});
  int c = input.addVertex({0, -1, -5000}, {0, 1, 0});
  input.addTriangle(a, b, c);
  auto pixels = render<Binned>(input, 64, 64);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      // Farther than the far plane is at most half a pixel.
      bool isFloor = y > 32, isSky = y < 32;
      float alpha = pixels[y * 64 + x].rgba.a;
      if (isFloor || isSky)
        ASSERT_EQ(alpha, isFloor ? 1 : 0) << x << ", " << y;
    }
}

TEST(Picture, NaNTrianglesAreDropped) {
  Input input = makeSoup(50);
  auto before = render<Binned>(input, 64, 48);
  float nan = std::nanf("");
  int v = input.addVertex({nan, nan, nan}, {nan, 0, 0});
  input.addTriangle(v, v, v);
  input.addTriangle(0, 1, v);
  auto after = render<Binned>(input, 64, 48);
  EXPECT_TRUE(equal(before, after));
}

} // namespace
