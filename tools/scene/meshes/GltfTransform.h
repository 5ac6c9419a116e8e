//===- GltfTransform.h - Where a glTF file puts its meshes ------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_SCENE_GLTFTRANSFORM_H
#define PIKO_TOOLS_SCENE_GLTFTRANSFORM_H

#include "GltfFile.h"

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <vector>

namespace piko::render {

/// A linear map and a move after it, in double precision: trees of nodes
/// multiply many.
struct Transform {
  glm::dmat3 linear = glm::dmat3(1);
  glm::dvec3 move = glm::dvec3(0);

  Transform operator*(const Transform &inner) const {
    return {linear * inner.linear, linear * inner.move + move};
  }
  glm::vec3 apply(glm::dvec3 point) const;
  bool isMirrored() const;
  /// The inverse of the transpose, but for its length.
  glm::dmat3 normalToWorld() const;
};

/// The transform of a node: its matrix, or translation, rotation and scale.
Transform readTransform(GltfFile &file, const GltfFile::Json &node);

/// The transforms of EXT_mesh_gpu_instancing.
std::vector<Transform> readInstances(GltfFile &file,
                                     const GltfFile::Json &instancing);

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_GLTFTRANSFORM_H
