//===- lighting.h - What light reaches a surface --------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// One term of the sum that piko/scene.h defines a surface's colour by.
//
//===----------------------------------------------------------------------===//
#ifndef COMMON_LIGHTING_H
#define COMMON_LIGHTING_H

#include <piko.h>
#include <piko/scene.h>

namespace raster {

/// What a light gives to a surface at `position` with a normal of unit length.
inline glm::vec3 irradiance(const piko::scene::Light &light, glm::vec3 position,
                            glm::vec3 normal) {
  glm::vec3 l = glm::vec3(light.position) - light.position.w * position;
  float facing = glm::max(0.0f, glm::dot(normal, l));
  return glm::vec3(light.color) * (facing / glm::sqrt(glm::dot(l, l)));
}

} // namespace raster

#endif // COMMON_LIGHTING_H
