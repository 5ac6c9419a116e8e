//===- MeshReaders.h - Reads meshes from the content of files ---*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Each reader takes all that a file says for a claim: counts, offsets and
// indices are compared with what is there before anything is allocated or read
// by them. Errors do not name the file, only the place within it.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_SCENE_MESHREADERS_H
#define PIKO_TOOLS_SCENE_MESHREADERS_H

#include "Piko/Scene/SceneFile.h"

#include <functional>
#include <string>
#include <string_view>

namespace piko::render {

/// PLY 1.0: text and binary of both byte orders. Reads the elements `vertex`,
/// `face` and `tristrips`.
Result<Mesh> readPly(std::string_view content);

/// Wavefront OBJ: its vertices, normals and faces.
Result<Mesh> readObj(std::string_view content);

/// STL, as text and binary.
Result<Mesh> readStl(std::string_view content);

/// The content of a file that another names, relative to the folder of that.
using OpenFile = std::function<Result<std::string>(const std::string &name)>;

/// glTF 2.0 and GLB: all triangles of the default scene.
Result<Mesh> readGltf(std::string_view content, const OpenFile &open);

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_MESHREADERS_H
