//===- LoadedModule.h - Libraries that are loaded when needed ---*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// OpenImageIO comes with 250 libraries and Embree with 44 MB, which take longer
// to load than a cached pipeline; so what uses them is a module each, and a
// build, or what was copied from one, may be without it.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_SCENE_LOADEDMODULE_H
#define PIKO_TOOLS_SCENE_LOADEDMODULE_H

#include <dlfcn.h>

namespace piko::render {

/// The one symbol of a module, which is looked for at the first call and stays
/// loaded; null where there is none. Each T is of one module.
template <class T> const T *findInModule(const char *file, const char *symbol) {
  static void *module = dlopen(file, RTLD_NOW | RTLD_LOCAL);
  return static_cast<const T *>(module ? dlsym(module, symbol) : nullptr);
}

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_LOADEDMODULE_H
