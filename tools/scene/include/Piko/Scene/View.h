//===- View.h - Camera, lights and ground for a scene -----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_VIEW_H
#define PIKO_SCENE_VIEW_H

#include "Piko/Scene/SceneFile.h"

#include <optional>
#include <string>
#include <vector>

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
  int width = 1024, height = 768;    ///< of the image
  float fovy = 45;                   ///< degrees from bottom to top
  std::optional<glm::vec3> eye = {}; ///< default: `at` plus so far along z that
                                     ///< the scene fits into the image
  std::optional<glm::vec3> at = {};  ///< default: the scene's centre
  /// Distances of the planes of depth along `forward`; default: as tightly
  /// about the scene as the eye's place allows, and nearer than all that it
  /// sees.
  std::optional<float> nearZ = {}, farZ = {};
};

/// The nearest that a near plane may be, of the far plane's distance: depths
/// are floats from -1 to 1, which nearer ones would leave to what is next to
/// the eye.
constexpr double leastNear = 1e-5;

/// A camera whose near and far planes, unless options say where they are,
/// enclose the scene as tightly as its position allows, but for what is nearer
/// than a thousandth of the scene's radius. The error is a direction that is
/// none, a radius of 0, or planes that are none: not above 0, the far one not
/// beyond the near one, or too far beyond for depths that are floats.
Result<scene::Camera> makeCamera(const ViewOptions &options,
                                 const Sphere &scene);

/// The same for a scene: where something is seen before the near plane and
/// options do not say where that is, it is moved there, but not nearer than
/// `leastNear` allows. What the planes then cut of what is seen is said to
/// `warnings`.
Result<scene::Camera> makeCamera(const ViewOptions &options, const Mesh &mesh,
                                 std::vector<std::string> &warnings);

/// `count` lights about the scene, even ones directions and odd ones points,
/// whose power adds up to about the same for any count.
std::vector<scene::Light> makeLights(int count, const Sphere &scene);

} // namespace piko::render

#endif // PIKO_SCENE_VIEW_H
