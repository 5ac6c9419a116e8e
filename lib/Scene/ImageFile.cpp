//===- ImageFile.cpp - Images in files ------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "ImageModule.h"

#include <dlfcn.h>

using namespace piko;
using namespace piko::render;

/// Loads the module at the first call.
static Result<const ImageFunctions *> getFunctions() {
  static void *module = dlopen(imageModuleFile, RTLD_NOW | RTLD_LOCAL);
  void *symbol = module ? dlsym(module, imageModuleSymbol) : nullptr;
  if (!symbol)
    return Error{std::string("cannot load ") + imageModuleFile +
                 ", which reads and writes images"};
  return static_cast<const ImageFunctions *>(symbol);
}

Result<Done> render::checkImageFormat(const std::string &path) {
  auto functions = getFunctions();
  if (!functions)
    return functions.error();
  return (*functions)->checkImageFormat(path);
}

Result<Done> render::writeImage(const std::string &path, int width, int height,
                                std::span<const scene::Color> pixels) {
  auto functions = getFunctions();
  if (!functions)
    return functions.error();
  return (*functions)->writeImage(path, width, height, pixels);
}

Result<Image> render::readImage(const std::string &path) {
  auto functions = getFunctions();
  if (!functions)
    return functions.error();
  return (*functions)->readImage(path);
}
