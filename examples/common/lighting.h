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

/// What a light gives that is in the direction l, at its distance unless it is
/// far away.
inline glm::vec3 irradianceFrom(glm::vec3 l, glm::vec4 color,
                                glm::vec3 normal) {
  float facing = glm::max(0.0f, glm::dot(normal, l));
  return glm::vec3(color) * (facing / glm::sqrt(glm::dot(l, l)));
}

/// What a light gives to a surface at `position` with a normal of unit length.
inline glm::vec3 irradiance(const piko::scene::Light &light, glm::vec3 position,
                            glm::vec3 normal) {
  glm::vec3 l(light.position);
  if (light.position.w == 0) // The same for all surfaces, and so is its length.
    return irradianceFrom(l, light.color, normal);
  return irradianceFrom(l - light.position.w * position, light.color, normal);
}

} // namespace raster

#endif // COMMON_LIGHTING_H
