//===- BvhModule.h - Embree, loaded when needed -----------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_SCENE_BVHMODULE_H
#define PIKO_TOOLS_SCENE_BVHMODULE_H

#include "Piko/Scene/Bvh.h"

namespace piko::render {

struct BvhFunctions {
  Result<Bvh> (*build)(const Mesh &mesh);
};

/// The module's one symbol, and the file it is in.
inline constexpr const char *bvhModuleSymbol = "piko_bvh_functions";
inline constexpr const char *bvhModuleFile = "libPikoBvh.so";

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_BVHMODULE_H
