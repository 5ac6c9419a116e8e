//===- PlyCheck.h - Whether a PLY file is a whole mesh ----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_SCENE_PLYCHECK_H
#define PIKO_LIB_SCENE_PLYCHECK_H

#include <string>
#include <string_view>

namespace piko::render {

/// What is wrong with a PLY file's header or length, or what it holds in place
/// of a mesh; "" if nothing is. assimp 5.2 does not return from a header that
/// is cut short, and reads beyond data that is.
std::string checkPly(std::string_view content);

} // namespace piko::render

#endif // PIKO_LIB_SCENE_PLYCHECK_H
