//===- OitTest.cpp - Transparency under the reference executor ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "oit/oit.piko.cpp"
#include "raster/raster.piko.cpp"

#include "PixelsIn.h"
#include "TestScene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

namespace {

using namespace test;
using oit::Layer;

constexpr int width = 101, height = 67; // no multiples of a bin's extent

template <class Pipeline> Picture render(const Input &input, float alpha) {
  Pipeline pipeline;
  pipeline.setDomain({width, height});
  pipeline.state().camera = makeCamera();
  pipeline.state().settings = input.settings;
  if constexpr (requires { pipeline.state().material; })
    pipeline.state().material.alpha = alpha;
  pipeline.state().lights.assign(input.lights);
  feedMesh(pipeline, input);
  pipeline.run();
  return copy(pipeline.state().color);
}

/// Whether a pixel has two fragments of the same depth.
bool hasEqualDepths(const Input &input) {
  glm::mat4 toClip = makeCamera().viewProjection;
  std::map<std::pair<int, int>, std::set<float>> depths;
  bool found = false;
  for (const Triangle &t : input.triangles) {
    glm::vec4 corner[3];
    for (int i = 0; i < 3; ++i)
      corner[i] = toClip * glm::vec4(input.vertices[t.vertex[i]].position, 1);
    raster::ScreenPolygon polygon(corner[0], corner[1], corner[2],
                                  {width, height}, false);
    polygon.rasterize(
        PixelsIn{{0, 0}, {width, height}}, [&](const raster::Sample &s) {
          found |= !depths[{s.pixel.x, s.pixel.y}].insert(s.depth).second;
        });
  }
  return found;
}

TEST(Oit, BinsDoNotChangeIt) {
  Input input = makeSoup(300);
  Picture whole = render<oit::WholeScreen>(input, 0.3f);
  EXPECT_TRUE(equal(whole, render<oit::Bins8>(input, 0.3f)));
  EXPECT_TRUE(equal(whole, render<oit::Bins16>(input, 0.3f)));
  EXPECT_TRUE(equal(whole, render<oit::Bins32>(input, 0.3f)));
}

TEST(Oit, OrderOfTrianglesDoesNotChangeIt) {
  Input input = makeSoup(300);
  ASSERT_FALSE(hasEqualDepths(input));
  Picture picture = render<oit::Bins16>(input, 0.3f);
  std::mt19937 random(5);
  for (int i = 0; i < 4; ++i) {
    std::shuffle(input.triangles.begin(), input.triangles.end(), random);
    EXPECT_TRUE(equal(picture, render<oit::Bins16>(input, 0.3f)));
  }
}

// Opaque sheets hide each other as in the rasterizer, whose picture has the
// first of two at the same depth.
TEST(Oit, OpaqueEqualsTheRasterizer) {
  Input input = makeSoup(200);
  for (Vertex &v : input.vertices) // the rasterizer's surfaces have one side
    v.normal = glm::normalize(-v.position);
  for (int i = 0; i < 100; ++i) {
    glm::ivec3 corner = input.triangles[i].vertex;
    for (int &v : {std::ref(corner.x), std::ref(corner.y), std::ref(corner.z)})
      v = input.addVertex(input.vertices[v].position,
                          input.vertices[v].normal + glm::vec3(0, 0.1f, 0));
    input.addTriangle(corner.x, corner.y, corner.z);
  }
  ASSERT_TRUE(hasEqualDepths(input));
  EXPECT_TRUE(equal(render<Binned>(input, 1), render<oit::Bins8>(input, 1)));
}

TEST(Oit, ClearSheetsAreNotSeen) {
  Picture picture = render<oit::Bins8>(makeSoup(100), 0);
  for (const Color &pixel : picture)
    EXPECT_EQ(pixel.rgba, Color{}.rgba);
}

// Layers as they are, without triangles.
template <int Bin> struct LayersPipe : piko::Pipe<oit::State> {
  oit::Blend<{.bin = Bin, .apart = false}> blend;
  LayersPipe() { source(blend); }
};

constexpr glm::ivec2 pixel(5, 2);

template <int Bin> glm::vec4 blend(const std::vector<Layer> &layers) {
  LayersPipe<Bin> pipe;
  pipe.setDomain({11, 4});
  pipe.feed(pipe.blend, layers);
  pipe.run();
  return pipe.state().color(pixel).rgba;
}

struct OitLayers : testing::Test {
  std::mt19937 random{7};
  std::vector<Layer> layers;

  float number() { return std::uniform_real_distribution<float>(0, 1)(random); }
  void add(float depth, float alpha) {
    glm::vec3 color(number(), number(), number());
    layers.push_back({pixel, depth, glm::vec4(color * alpha, alpha)});
  }

  /// The definition, in doubles: of equal depths, the first is in front.
  glm::dvec4 expected() const {
    std::multimap<float, glm::dvec4> sorted; // keeps the order of equals
    for (const Layer &l : layers)
      sorted.emplace(l.depth, l.rgba);
    glm::dvec4 result(Color{}.rgba);
    for (auto it = sorted.rbegin(); it != sorted.rend(); ++it)
      result = it->second + (1 - it->second.a) * result;
    return result;
  }
  void expectDefinition() const {
    glm::vec4 result = blend<8>(layers);
    EXPECT_LT(glm::distance(glm::dvec4(result), expected()), 1e-6);
    EXPECT_EQ(result, blend<0>(layers));
  }
};

TEST_F(OitLayers, HundredsAtOnePixel) {
  for (int i = 0; i < 700; ++i)
    add(number(), 0.02f * number());
  expectDefinition();
  glm::vec4 result = blend<8>(layers);
  for (int i = 0; i < 3; ++i) {
    std::shuffle(layers.begin(), layers.end(), random);
    EXPECT_EQ(blend<8>(layers), result);
  }
}

TEST_F(OitLayers, EqualDepthsAreOrderedByLineage) {
  for (int i = 0; i < 300; ++i)
    add(float(i % 3), 0.1f);
  expectDefinition();
  layers.resize(2);
  layers[0] = {pixel, 0.5f, {1, 0, 0, 1}};
  layers[1] = {pixel, 0.5f, {0, 1, 0, 1}};
  EXPECT_EQ(blend<8>(layers), glm::vec4(1, 0, 0, 1));
  std::swap(layers[0], layers[1]);
  EXPECT_EQ(blend<8>(layers), glm::vec4(0, 1, 0, 1));
}

TEST_F(OitLayers, AlphaOneHidesAndAlphaZeroLeaves) {
  for (int i = 0; i < 200; ++i)
    add(2 + number(), i % 2 ? number() : 1);
  Layer hides{pixel, 1, {0.25f, 0.5f, 0.75f, 1}};
  layers.push_back(hides);
  EXPECT_EQ(blend<8>(layers), hides.rgba);
  for (int i = 0; i < 200; ++i)
    add(number(), 0);
  EXPECT_EQ(blend<8>(layers), hides.rgba);
  expectDefinition();
}

TEST_F(OitLayers, DepthsOfEitherSign) {
  for (float depth : {-0.0f, 0.0f, 1.0f, -1.0f, 1e-40f, -1e-40f})
    add(depth, 0.5f);
  expectDefinition();
}

// Layers of other pixels in the bin lie between those of one.
TEST_F(OitLayers, PixelsKeepApart) {
  for (int i = 0; i < 100; ++i)
    add(number(), 0.1f);
  glm::vec4 alone = blend<8>(layers);
  for (int i = 0; i < 300; ++i) {
    add(number(), 0.1f);
    layers.back().pixel = {i % 11, i % 2};
  }
  std::shuffle(layers.begin(), layers.end(), random);
  EXPECT_EQ(blend<8>(layers), alone);
  EXPECT_EQ(blend<0>(layers), alone);
}

} // namespace
