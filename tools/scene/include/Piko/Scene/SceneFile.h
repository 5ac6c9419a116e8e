//===- SceneFile.h - Meshes and patches from files --------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_SCENEFILE_H
#define PIKO_SCENE_SCENEFILE_H

#include "Piko/Scene/Result.h"

#include <piko/scene.h>

#include <functional>
#include <string>
#include <vector>

namespace piko::render {

/// Triangles and the vertices that they share, or patches. Each vertex,
/// triangle and patch knows its index, and every triangle's vertices exist.
struct Mesh {
  std::vector<scene::Vertex> vertices;
  std::vector<scene::Triangle> triangles;
  std::vector<scene::Patch> patches;
  /// What of the file is left out and may change a picture, one thing each.
  std::vector<std::string> warnings;
};

/// Is called with the part of the work that is done, from 0 to 1.
using ProgressFunction = std::function<void(double)>;

/// Reads all triangles of a scene file, in world space: OBJ, PLY, STL, glTF and
/// GLB, by readers that check all that a file says, and whatever else assimp
/// knows, by the program piko-import. Or all patches of a .bpt file. Any of
/// them may be gzipped (".gz").
///
/// The transforms of nodes are applied, and polygons are split. Triangles share
/// vertices as in the file; where it shares none, those with the same position
/// and normal are joined. Vertices without a normal get the area-weighted mean
/// of those of the triangles around them.
///
/// Errors: the file cannot be read, is cut short, contradicts itself, holds no
/// triangle and no patch (as point clouds and Gaussian splats do), requires a
/// glTF extension that is not supported (as compressed meshes do), or has a
/// position that is not finite. What is left out and may change a picture is
/// among the mesh's warnings.
Result<Mesh> loadMesh(const std::string &path,
                      const ProgressFunction &progress = {});

} // namespace piko::render

#endif // PIKO_SCENE_SCENEFILE_H
