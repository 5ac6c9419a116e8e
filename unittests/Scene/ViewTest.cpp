//===- ViewTest.cpp - Cameras and lights ----------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/View.h"

#include <gtest/gtest.h>

using namespace piko::render;
using piko::scene::Camera;
using piko::scene::Light;

namespace {

const Sphere sphere{{1, 2, 3}, 4};

/// The image point of a position, from -1 to 1, and its depth.
glm::vec3 project(const Camera &camera, glm::vec3 p) {
  glm::vec4 clip = camera.viewProjection * glm::vec4(p, 1);
  return glm::vec3(clip) / clip.w;
}

TEST(View, FitsTheSphereIntoTheNarrowerSide) {
  for (auto [width, height] : {std::pair(1024, 768), std::pair(300, 900)}) {
    ViewOptions options;
    options.width = width;
    options.height = height;
    auto camera = makeCamera(options, sphere);
    ASSERT_TRUE(camera);
    EXPECT_EQ(camera->forward, glm::vec3(0, 0, -1));
    glm::vec3 center = project(*camera, sphere.center);
    EXPECT_NEAR(center.x, 0, 1e-5);
    EXPECT_NEAR(center.y, 0, 1e-5);
    // The cone that touches the sphere touches the nearer border.
    float distance = glm::length(camera->eye - sphere.center);
    float slope = sphere.radius / std::sqrt(distance * distance -
                                            sphere.radius * sphere.radius);
    float side = std::min(glm::length(camera->right), glm::length(camera->up));
    EXPECT_NEAR(slope, side, 1e-4);
  }
}

TEST(View, ProjectionAgreesWithTheRays) {
  ViewOptions options{
      .fovy = 70, .eye = glm::vec3(9, -3, 5), .at = glm::vec3(1, 2, 3)};
  auto camera = makeCamera(options, sphere);
  ASSERT_TRUE(camera);
  for (float sx : {-1.0f, 0.25f, 1.0f})
    for (float sy : {-1.0f, 0.5f}) {
      glm::vec3 p = camera->eye + 3.0f * (camera->forward + camera->right * sx +
                                          camera->up * sy);
      EXPECT_NEAR(project(*camera, p).x, sx, 1e-5);
      EXPECT_NEAR(project(*camera, p).y, sy, 1e-5);
    }
  EXPECT_NEAR(glm::length(camera->right) / glm::length(camera->up), 1024. / 768,
              1e-5);
}

TEST(View, GroundLiesUnderTheSceneAndFacesUp) {
  Mesh mesh;
  mesh.vertices = {{{0, 5, 2}, {}, 0}, {{4, 1, 2}, {}, 1}, {{0, 1, 2}, {}, 2}};
  mesh.triangles = {{{0, 1, 2}, 0}};
  Sphere scene = boundingSphere(mesh);
  addGround(mesh);
  ASSERT_EQ(mesh.vertices.size(), 7u);
  ASSERT_EQ(mesh.triangles.size(), 3u);
  float area = 0;
  for (int i = 1; i < 3; ++i) {
    EXPECT_EQ(mesh.triangles[i].index, i);
    glm::vec3 corner[3];
    for (int j = 0; j < 3; ++j) {
      const auto &v = mesh.vertices[mesh.triangles[i].vertex[j]];
      EXPECT_EQ(v.position.y, 1);
      EXPECT_EQ(v.normal, glm::vec3(0, 1, 0));
      EXPECT_EQ(&mesh.vertices[v.index], &v);
      EXPECT_NEAR(glm::abs(v.position.x - scene.center.x), 2 * scene.radius,
                  1e-5);
      corner[j] = v.position;
    }
    glm::vec3 up = glm::cross(corner[1] - corner[0], corner[2] - corner[0]);
    EXPECT_GT(up.y, 0);
    area += up.y / 2;
  }
  EXPECT_NEAR(area, 16 * scene.radius * scene.radius, 1e-3);
}

TEST(View, GroundUnderPatchesIsAPatch) {
  Mesh mesh;
  mesh.patches.resize(1);
  for (int i = 0; i < 16; ++i)
    mesh.patches[0].points[i] = {i, 3 - i % 5, 2};
  Sphere scene = boundingSphere(mesh);
  addGround(mesh);
  EXPECT_TRUE(mesh.triangles.empty());
  ASSERT_EQ(mesh.patches.size(), 2u);
  const auto &ground = mesh.patches[1];
  EXPECT_EQ(ground.index, 1);
  for (glm::vec3 p : ground.points)
    EXPECT_EQ(p.y, -1);
  glm::vec3 up = glm::cross(ground.points[12] - ground.points[0],
                            ground.points[3] - ground.points[0]);
  EXPECT_NEAR(up.y / (16 * scene.radius * scene.radius), 1, 1e-5);
}

TEST(View, PlanesEncloseTheScene) {
  for (glm::vec3 eye : {glm::vec3(1, 2, 30), glm::vec3(1, 2, 4)}) {
    auto camera = makeCamera({.eye = eye, .at = sphere.center}, sphere);
    ASSERT_TRUE(camera);
    EXPECT_GT(camera->nearZ, 0);
    float distance = glm::length(eye - sphere.center);
    EXPECT_LE(camera->nearZ,
              std::max(distance - sphere.radius, 1e-3f * sphere.radius));
    EXPECT_GE(camera->farZ, distance + sphere.radius);
    auto at = [&](float z) { return eye + camera->forward * z; };
    EXPECT_NEAR(project(*camera, at(camera->nearZ)).z, -1, 1e-3);
    EXPECT_NEAR(project(*camera, at(camera->farZ)).z, 1, 1e-3);
  }
}

/// A square ground of 2000 a side at y = 0.
Mesh makeGround() {
  Mesh mesh;
  for (glm::vec2 p : {glm::vec2(-1, -1), {1, -1}, {1, 1}, {-1, 1}})
    mesh.vertices.push_back({{1000 * p.x, 0, 1000 * p.y},
                             {0, 1, 0},
                             int32_t(mesh.vertices.size())});
  mesh.triangles = {{{0, 2, 1}, 0}, {{0, 3, 2}, 1}};
  return mesh;
}

// The lowest ray of the view meets the ground first: at a distance of
// height / (tan(22.5 degrees) + tan(slope)), of the axes that are turned.
TEST(View, TheNearPlaneIsBeforeWhatIsSeen) {
  for (float height : {0.5f, 0.05f, 10.0f}) {
    ViewOptions options{.width = 320, .height = 240};
    options.eye = {0, height, 0};
    options.at = {5, 0, 0};
    std::vector<std::string> warnings;
    auto camera = makeCamera(options, makeGround(), warnings);
    ASSERT_TRUE(camera);
    EXPECT_TRUE(warnings.empty());
    double slope = std::atan(height / 5.0), half = M_PI / 8;
    double nearest = height / std::sin(slope + half) * std::cos(half);
    EXPECT_LE(camera->nearZ, nearest);
    EXPECT_GE(camera->nearZ, std::min(0.99 * nearest, 1.4));
    EXPECT_GE(camera->farZ, 1414);
  }
}

TEST(View, AScenesOwnPlanesStayWhereNothingIsNearer) {
  Mesh mesh = makeGround();
  ViewOptions options{.eye = glm::vec3(0, 900, 1), .at = glm::vec3(0)};
  std::vector<std::string> warnings;
  auto fitted = makeCamera(options, mesh, warnings);
  auto whole = makeCamera(options, boundingSphere(mesh));
  ASSERT_TRUE(fitted && whole);
  EXPECT_EQ(fitted->nearZ, whole->nearZ);
  EXPECT_EQ(fitted->farZ, whole->farZ);
  EXPECT_EQ(fitted->viewProjection, whole->viewProjection);
}

TEST(View, PixelsThatFloatsDoNotResolveAreSaid) {
  ViewOptions options{.width = 320, .height = 240, .eye = glm::vec3(0, 0, 3)};
  auto warn = [&](float fovy, glm::vec3 at) {
    options.fovy = fovy;
    options.at = at;
    std::vector<std::string> warnings;
    EXPECT_TRUE(makeCamera(options, makeGround(), warnings));
    std::erase_if(warnings, [](const std::string &warning) {
      return !warning.starts_with("the field of view is narrower");
    });
    return warnings.size() == 1;
  };
  EXPECT_FALSE(warn(1e-7f, {0, 0, 0})); // along an axis
  EXPECT_FALSE(warn(0.01f, {2, -1, 0}));
  EXPECT_TRUE(warn(1e-4f, {2, -1, 0}));
}

TEST(View, WhatPlanesCutIsSaid) {
  ViewOptions options{.width = 320, .height = 240};
  options.eye = {0, 0.5f, 0};
  options.at = {5, 0, 0};
  options.nearZ = 2;
  options.farZ = 500;
  std::vector<std::string> warnings;
  auto camera = makeCamera(options, makeGround(), warnings);
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->nearZ, 2);
  EXPECT_EQ(camera->farZ, 500);
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_TRUE(warnings[0].starts_with("the near plane, at a distance of 2, "));
  EXPECT_TRUE(warnings[1].starts_with("the far plane, at a distance of 500, "));

  // Nearer than depths as floats allow.
  options.nearZ = options.farZ = {};
  options.eye = {0, 1e-3f, 0};
  warnings.clear();
  camera = makeCamera(options, makeGround(), warnings);
  ASSERT_TRUE(camera);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_TRUE(warnings[0].starts_with("the near plane, at a distance of 0.01"));
  EXPECT_NE(warnings[0].find("the nearest at 0.0024"), std::string::npos)
      << warnings[0];
}

TEST(View, PatchesAreSeenAsTrianglesAre) {
  Mesh mesh;
  mesh.patches.resize(1);
  for (int i = 0; i < 16; ++i)
    mesh.patches[0].points[i] = {1000 * (i % 4 - 1.5f) / 1.5f, 0,
                                 1000 * (i / 4 - 1.5f) / 1.5f};
  ViewOptions options{.eye = glm::vec3(0, 0.5f, 0), .at = glm::vec3(5, 0, 0)};
  std::vector<std::string> warnings;
  auto camera = makeCamera(options, mesh, warnings);
  ASSERT_TRUE(camera);
  EXPECT_TRUE(warnings.empty());
  EXPECT_LE(camera->nearZ, 0.98f);
}

TEST(View, PlanesThatAreNone) {
  auto planes = [](std::optional<float> nearZ, std::optional<float> farZ) {
    ViewOptions options;
    options.nearZ = nearZ;
    options.farZ = farZ;
    auto camera = makeCamera(options, sphere);
    return camera ? std::string() : camera.error().message;
  };
  EXPECT_EQ(planes(1, 2), "");
  EXPECT_EQ(planes(100, {}), ""); // beyond all of it
  EXPECT_TRUE(planes(0, 1).starts_with("expected a near plane at a distance"));
  EXPECT_TRUE(planes(NAN, 1).starts_with("expected a near plane at a"));
  EXPECT_TRUE(planes(2, 2).starts_with("expected a far plane beyond the near"));
  EXPECT_TRUE(planes({}, 1).starts_with("expected a far plane beyond the"));
  EXPECT_TRUE(planes(1e-9f, {}).starts_with("expected a near plane at 1e-05"));
}

TEST(View, FieldsOfViewThatFloatsDoNotResolve) {
  ViewOptions options;
  options.fovy = 1e-7f;
  EXPECT_TRUE(makeCamera(options, sphere));
  options.fovy = 1e-30f;
  EXPECT_FALSE(makeCamera(options, sphere));
}

TEST(View, LooksStraightDown) {
  auto camera =
      makeCamera({.eye = glm::vec3(1, 50, 3), .at = sphere.center}, sphere);
  ASSERT_TRUE(camera);
  EXPECT_NEAR(glm::length(camera->up), std::tan(M_PI / 8), 1e-6);
  EXPECT_LT(project(*camera, {1, 2, 4}).y, 0); // +z is at the bottom
}

TEST(View, Errors) {
  EXPECT_FALSE(makeCamera({}, Sphere{{0, 0, 0}, 0}));
  ViewOptions flat;
  flat.fovy = 180;
  EXPECT_FALSE(makeCamera(flat, sphere));
  EXPECT_FALSE(makeCamera({.eye = glm::vec3(1, 1, 1), .at = glm::vec3(1, 1, 1)},
                          sphere));
}

TEST(View, LightsAlternateAndKeepTheirPower) {
  EXPECT_TRUE(makeLights(0, sphere).empty());
  auto lights = makeLights(100, sphere);
  ASSERT_EQ(lights.size(), 100u);
  float power = 0;
  for (size_t i = 0; i < lights.size(); ++i) {
    const Light &light = lights[i];
    EXPECT_EQ(light.position.w, i % 2);
    glm::vec3 p(light.position);
    if (i % 2)
      EXPECT_NEAR(glm::length(p - sphere.center), 2 * sphere.radius, 1e-4);
    else
      EXPECT_NEAR(glm::length(p), 1, 1e-6);
    power += light.color.r;
  }
  EXPECT_NEAR(power, 3 * 0.7f, 0.05f);
}

TEST(View, BoundingSphereIsThatOfTheBox) {
  Mesh mesh;
  for (glm::vec3 p : {glm::vec3(0, 0, 0), glm::vec3(2, 4, 4)})
    mesh.vertices.push_back({p, {0, 0, 1}, int32_t(mesh.vertices.size())});
  Sphere bounds = boundingSphere(mesh);
  EXPECT_EQ(bounds.center, glm::vec3(1, 2, 2));
  EXPECT_EQ(bounds.radius, 3);
}

} // namespace
