//===- PatchFile.h - Bezier patches from .bpt files -------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_SCENE_PATCHFILE_H
#define PIKO_TOOLS_SCENE_PATCHFILE_H

#include "Piko/Scene/Result.h"

#include <piko/scene.h>

#include <string_view>
#include <vector>

namespace piko::render {

/// Reads the text of a .bpt file: the number of patches, then for each its
/// degrees along u and v and its control points, v fastest. Only bicubic
/// patches are known. An error names the line.
Result<std::vector<scene::Patch>> readPatches(std::string_view text);

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_PATCHFILE_H
