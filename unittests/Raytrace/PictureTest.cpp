//===- PictureTest.cpp - The ray tracer under the reference executor ------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Meshes.h"
#include "raytrace.piko.cpp"

#include <gtest/gtest.h>

#include <cstring>

using piko::render::buildBvh;
using piko::render::Bvh;

namespace {

struct Input {
  Mesh mesh;
  std::vector<Light> lights;
  float mirror = 0.25f;
  int depth = 0;
  bool shadows = false;
};

/// At the origin, looking along -z, 90 degrees wide and high.
Camera makeCamera() {
  Camera camera{};
  camera.forward = {0, 0, -1};
  camera.right = {1, 0, 0};
  camera.up = {0, 1, 0};
  return camera;
}

std::vector<Color> render(Input &input, int w, int h) {
  Bvh bvh = *buildBvh(input.mesh);
  raytrace::Raytracer pipe;
  pipe.setDomain({w, h});
  pipe.state().camera = makeCamera();
  pipe.state().settings = {};
  pipe.state().depth = input.depth;
  pipe.state().mirror = input.mirror;
  pipe.state().shadows = input.shadows;
  pipe.state().bounds = bvh.bounds;
  pipe.state().nodes.assign(bvh.nodes);
  pipe.state().leaves.assign(bvh.triangles);
  pipe.state().triangles.assign(input.mesh.triangles);
  pipe.state().vertices.assign(input.mesh.vertices);
  pipe.state().lights.assign(input.lights);
  const std::vector<piko::scene::Nothing> nothing;
  pipe.feed(pipe.primary, nothing);
  pipe.run();
  const Color *image = pipe.state().image.data();
  return {image, image + size_t(w) * h};
}

/// The color of a surface by the formula in piko/scene.h.
glm::vec3 shade(glm::vec3 p, glm::vec3 n, const std::vector<Light> &lights) {
  glm::dvec3 sum(Settings().ambient);
  for (const Light &light : lights) {
    glm::dvec3 l =
        glm::dvec3(light.position) - double(light.position.w) * glm::dvec3(p);
    sum += glm::dvec3(light.color) *
           (std::max(0.0, glm::dot(glm::dvec3(n), l)) / glm::length(l));
  }
  return glm::vec3(double(Settings().albedo) * sum);
}

void expectColor(const Color &pixel, glm::vec3 color) {
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(pixel.rgba[i], color[i], 1e-5);
  EXPECT_EQ(pixel.rgba.a, 1);
}

TEST(Raytracer, ShadesByTheFormula) {
  Input input;
  glm::vec3 n = glm::normalize(glm::vec3(0.3f, 0.2f, 1));
  addRectangle(input.mesh, {0, 0, -2}, {4, 0, 0}, {0, 4, 0}, n);
  input.lights = {{{0.48f, 0.6f, 0.64f, 0}, {0.5f, 0.4f, 0.3f, 0}},
                  {{1, 1, -1, 1}, {0.1f, 0.2f, 0.3f, 0}},
                  {{0, 0, -9, 1}, {9, 9, 9, 0}}}; // after the rectangle
  // Nothing is in the way, and partial bins are at the edges.
  for (bool shadows : {false, true}) {
    input.shadows = shadows;
    const int w = 37, h = 21;
    auto image = render(input, w, h);
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        glm::vec3 p(2 * (2 * (float(x) + 0.5f) / w - 1),
                    2 * (1 - 2 * (float(y) + 0.5f) / h), -2);
        expectColor(image[y * w + x], shade(p, n, input.lights));
      }
  }
}

// A small square in the air, its shadow on the ground after it, of a light far
// away and of one that is near.
TEST(Raytracer, Shadows) {
  Input input;
  addRectangle(input.mesh, {0, 0, -8}, {20, 0, 0}, {0, 20, 0}, {0, 0, 1});
  addRectangle(input.mesh, {0, 3, -4}, {0.5f, 0, 0}, {0, 0.5f, 0}, {0, 0, 1});
  input.shadows = true;
  const int side = 32;
  for (glm::vec4 position :
       {glm::vec4(0, 0.6f, 0.8f, 0), glm::vec4(0, 6, 0, 1)}) {
    input.lights = {{position, glm::vec4(1)}};
    auto image = render(input, side, side);
    // The centre of the square throws its shadow to y = 0.
    expectColor(image[16 * side + 16], glm::vec3(0.8f * 0.05f));
    for (int x : {8, 24}) {
      glm::vec3 p(8 * (2 * (float(x) + 0.5f) / side - 1), -0.25f, -8);
      expectColor(image[16 * side + x], shade(p, {0, 0, 1}, input.lights));
    }
  }
  // A light before the square throws none.
  input.lights = {{{0, 1.5f, -6, 1}, glm::vec4(1)}};
  auto image = render(input, side, side);
  EXPECT_GT(image[16 * side + 16].rgba.g, 0.5f);
}

// Two mirrors that face each other, with the camera in between: `depth` says
// how often a ray goes to and fro.
TEST(Raytracer, MirrorsUpToADepth) {
  Input input;
  addRectangle(input.mesh, {0, 0, -2}, {90, 0, 0}, {0, 90, 0}, {0, 0, 1});
  addRectangle(input.mesh, {0, 0, 3}, {90, 0, 0}, {0, 90, 0}, {0, 0, -1});
  input.lights = {{{0, 0, 1, 0}, {0.7f, 0.6f, 0.5f, 0}}, // seen from in front
                  {{0, 0, -1, 0}, {0.1f, 0.2f, 0.3f, 0}}};
  glm::vec3 front = shade({}, {0, 0, 1}, input.lights);
  glm::vec3 back = shade({}, {0, 0, -1}, input.lights);
  for (float mirror : {0.25f, 1.0f, 0.0f})
    for (int depth = 0; depth < 5; ++depth) {
      input.mirror = mirror;
      input.depth = depth;
      glm::vec3 color = depth % 2 ? back : front;
      for (int i = depth - 1; i >= 0; --i)
        color = color * mirror + (i % 2 ? back : front) * (1 - mirror);
      expectColor(render(input, 4, 4)[5], color);
    }
}

// What mirrors show where there is nothing is the background.
TEST(Raytracer, MirrorsShowTheBackground) {
  Input input;
  addRectangle(input.mesh, {0, 0, -2}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  input.mirror = 1;
  input.depth = 3;
  auto image = render(input, 16, 16);
  expectColor(image[8 * 16 + 8], glm::vec3(Color().rgba));
  EXPECT_EQ(image[0].rgba, Color().rgba);
}

// A closed surface with one normal a facet is lit where light falls on it: it
// throws no shadow on itself there.
TEST(Raytracer, NoShadowOnItself) {
  for (float scale : {1e-6f, 1.0f, 1e6f}) {
    Input input;
    glm::vec3 axis = glm::normalize(glm::vec3(1, 2, 3));
    glm::vec3 right = glm::normalize(glm::cross(axis, {0, 1, 0}));
    glm::vec3 up = glm::cross(right, axis);
    for (glm::vec3 n : {axis, -axis, right, -right, up, -up}) {
      glm::vec3 a = n == axis || n == -axis ? right : axis;
      addRectangle(input.mesh, scale * (n - glm::vec3(0, 0, 4)), scale * a,
                   scale * glm::cross(n, a), n);
    }
    input.lights = {{{0.6f, 0, 0.8f, 0}, glm::vec4(1)}};
    auto without = render(input, 64, 64);
    input.shadows = true;
    auto with = render(input, 64, 64);
    int drawn = 0;
    for (size_t i = 0; i < with.size(); ++i) {
      EXPECT_NEAR(with[i].rgba.g, without[i].rgba.g, 1e-6);
      drawn += with[i].rgba.a != 0;
    }
    EXPECT_GT(drawn, 300);
  }
}

TEST(Raytracer, EmptySceneIsBackground) {
  Input input;
  input.depth = 2;
  input.shadows = true;
  for (const Color &pixel : render(input, 20, 12))
    EXPECT_EQ(pixel.rgba, Color().rgba);
}

// Triangles without an area or with a corner that is NaN change nothing.
TEST(Raytracer, BrokenTrianglesAreNotDrawn) {
  Input input;
  input.mesh = makePotato(12, {0, 0, -3});
  input.lights = {{{0, 0.6f, 0.8f, 0}, {0.7f, 0.6f, 0.5f, 0}}};
  input.depth = 1;
  input.shadows = true;
  auto before = render(input, 64, 48);
  float nan = std::nanf("");
  int v = addVertex(input.mesh, {nan, nan, nan}, {nan, 0, 0});
  addTriangle(input.mesh, v, v, v);
  addTriangle(input.mesh, 0, 1, v);
  addTriangle(input.mesh, 0, 1, 1);
  auto after = render(input, 64, 48);
  EXPECT_EQ(
      std::memcmp(before.data(), after.data(), before.size() * sizeof(Color)),
      0);
}

} // namespace
