// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Vectors.h - What several files ask of vectors ----------------------===//
#ifndef PIKO_TOOLS_SCENE_VECTORS_H
#define PIKO_TOOLS_SCENE_VECTORS_H

#include <cmath>
#include <glm/vec3.hpp>

namespace piko::render {

inline bool isFinite(glm::vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_VECTORS_H
