//===- ImportProcess.h - Scenes that another process reads ------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_SCENE_IMPORTPROCESS_H
#define PIKO_TOOLS_SCENE_IMPORTPROCESS_H

#include "Piko/Scene/SceneFile.h"

namespace piko::render {

/// Seconds of a processor that reading another format may take.
inline constexpr unsigned importSeconds = 600;

/// Reads a scene of a format that has no reader here, by the program
/// piko-import: $PIKO_IMPORTER, or the one beside this program, or one on PATH.
/// Whatever becomes of it, it ends with a mesh that was checked or an error.
Result<Mesh> importMesh(const std::string &path);

/// What a message about a scene's file begins with.
std::string describeLoad(const std::string &path);

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_IMPORTPROCESS_H
