//===- GltfCheck.h - Whether a glTF file can be read ------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_SCENE_GLTFCHECK_H
#define PIKO_LIB_SCENE_GLTFCHECK_H

#include <string>
#include <string_view>

namespace piko::render {

/// Which extension a glTF or GLB file requires that is not supported, and what
/// to do; "" if there is none, or if the file is broken. assimp 5.2 takes
/// quantized numbers for floats without a word.
std::string checkGltf(std::string_view content);

} // namespace piko::render

#endif // PIKO_LIB_SCENE_GLTFCHECK_H
