//===- Bvh.cpp - Bounding volume hierarchies ------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "BvhModule.h"
#include "LoadedModule.h"

using namespace piko;
using namespace piko::render;

Result<Bvh> render::buildBvh(const Mesh &mesh) {
  const auto *functions =
      findInModule<BvhFunctions>(bvhModuleFile, bvhModuleSymbol);
  if (!functions)
    return Error{std::string("cannot build a bounding volume hierarchy "
                             "without ") +
                 bvhModuleFile + ", which uses Embree"};
  return functions->build(mesh);
}
