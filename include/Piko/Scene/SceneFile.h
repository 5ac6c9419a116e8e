//===- SceneFile.h - Meshes and patches from files --------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_SCENEFILE_H
#define PIKO_SCENE_SCENEFILE_H

#include "Piko/Scene/Result.h"

#include <piko/scene.h>

#include <functional>
#include <vector>

namespace piko::render {

/// Triangles and the vertices that they share, or patches. Each vertex,
/// triangle and patch knows its index, and every triangle's vertices exist.
struct Mesh {
  std::vector<scene::Vertex> vertices;
  std::vector<scene::Triangle> triangles;
  std::vector<scene::Patch> patches;
};

/// Is called with the part of the work that is done, from 0 to 1.
using ProgressFunction = std::function<void(double)>;

/// Reads all triangles of a scene file, in world space: OBJ, PLY, STL, glTF,
/// GLB and whatever else assimp knows; PLY, OBJ and STL also gzipped (".gz").
/// Or all patches of a .bpt file, which may be gzipped, too.
///
/// The transforms of nodes are applied, and polygons are split. Triangles share
/// vertices as in the file; where it shares none, those with the same position
/// and normal are joined. Vertices without a normal get the area-weighted mean
/// of those of the triangles around them.
///
/// Errors: the file cannot be read, is no scene, holds no triangle and no
/// patch (as point clouds and Gaussian splats do), requires a glTF extension
/// that is not supported (as compressed and quantized meshes do), or has a
/// position that is not finite.
Result<Mesh> loadMesh(const std::string &path,
                      const ProgressFunction &progress = {});

} // namespace piko::render

#endif // PIKO_SCENE_SCENEFILE_H
