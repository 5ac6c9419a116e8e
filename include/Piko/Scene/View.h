//===- View.h - Camera, lights and ground for a scene -----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_VIEW_H
#define PIKO_SCENE_VIEW_H

#include "Piko/Scene/SceneFile.h"

#include <optional>

namespace piko::render {

struct Sphere {
  glm::vec3 center;
  float radius;
};

/// The sphere about the middle of the bounding box that holds all vertices and
/// control points. There must be one.
Sphere boundingSphere(const Mesh &mesh);

/// Puts a square, of triangles or one patch as the scene itself, under the
/// scene, at its lowest point: level, seen from above,
/// and four radii of the scene wide.
void addGround(Mesh &mesh);

struct ViewOptions {
  int width = 1024, height = 768; ///< of the image
  float fovy = 45;                ///< degrees from bottom to top
  std::optional<glm::vec3> eye;   ///< default: `at` plus so far along z that
                                  ///< the scene fits into the image
  std::optional<glm::vec3> at;    ///< default: the scene's centre
};

/// A camera whose near and far planes enclose the scene as tightly as its
/// position allows. The error is a direction that is none, or a radius of 0.
Result<scene::Camera> makeCamera(const ViewOptions &options,
                                 const Sphere &scene);

/// `count` lights about the scene, even ones directions and odd ones points,
/// whose power adds up to about the same for any count.
std::vector<scene::Light> makeLights(int count, const Sphere &scene);

} // namespace piko::render

#endif // PIKO_SCENE_VIEW_H
