//===- Bvh.cpp - A tree of boxes about a mesh -----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "BvhModule.h"
#include "LoadedModule.h"

using namespace piko;
using namespace piko::render;

Result<Bvh> render::buildBvh(const Mesh &mesh) {
  const auto *functions =
      findInModule<BvhFunctions>(bvhModuleFile, bvhModuleSymbol);
  if (!functions)
    return Error{std::string("cannot build a tree: there is no ") +
                 bvhModuleFile + ", which uses Embree"};
  return functions->build(mesh);
}
