//===- Camera.h - A camera for all scenes -----------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef UNITTESTS_SUPPORT_CAMERA_H
#define UNITTESTS_SUPPORT_CAMERA_H

#include <piko/scene.h>

namespace test {

/// At the origin, looking along -z, 90 degrees wide and high.
inline piko::scene::Camera makeCamera(float nearZ = 0.25f, float farZ = 100) {
  piko::scene::Camera camera{};
  camera.forward = {0, 0, -1};
  camera.right = {1, 0, 0};
  camera.up = {0, 1, 0};
  camera.nearZ = nearZ;
  camera.farZ = farZ;
  camera.viewProjection = glm::mat4(0);
  camera.viewProjection[0][0] = 1;
  camera.viewProjection[1][1] = 1;
  camera.viewProjection[2][2] = -(farZ + nearZ) / (farZ - nearZ);
  camera.viewProjection[2][3] = -1;
  camera.viewProjection[3][2] = -2 * farZ * nearZ / (farZ - nearZ);
  return camera;
}

} // namespace test

#endif // UNITTESTS_SUPPORT_CAMERA_H
