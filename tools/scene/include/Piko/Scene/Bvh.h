//===- Bvh.h - A tree of boxes about a mesh ---------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_BVH_H
#define PIKO_SCENE_BVH_H

#include "Piko/Scene/SceneFile.h"

namespace piko::render {

/// A tree of boxes about the triangles of a mesh, as piko/scene.h describes it.
/// The triangles of a leaf are in order of index.
struct Bvh {
  std::vector<scene::BvhNode> nodes;
  std::vector<scene::BvhTriangle> triangles;
  scene::Bounds bounds{}; ///< 0 if there are no triangles
};

/// Builds a tree with Embree, by the surface area heuristic. Triangles with a
/// corner that is not finite are left out: no ray meets them. The error is that
/// Embree fails, as for want of memory.
Result<Bvh> buildBvh(const Mesh &mesh);

} // namespace piko::render

#endif // PIKO_SCENE_BVH_H
