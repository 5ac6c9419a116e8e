//===- ImageModule.h - OpenImageIO, loaded when needed ----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// OpenImageIO comes with 250 libraries, which take longer to load than a cached
// pipeline; so the code that uses it is a module of its own.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_LIB_SCENE_IMAGEMODULE_H
#define PIKO_LIB_SCENE_IMAGEMODULE_H

#include "Piko/Scene/ImageFile.h"

namespace piko::render {

/// The functions of ImageFile.h, as the module has them.
struct ImageFunctions {
  decltype(&render::writeImage) writeImage;
  decltype(&render::checkImageFormat) checkImageFormat;
  decltype(&render::readImage) readImage;
};

/// The module's one symbol, and the file it is in.
inline constexpr const char *imageModuleSymbol = "piko_image_functions";
inline constexpr const char *imageModuleFile = "libPikoImage.so";

} // namespace piko::render

#endif // PIKO_LIB_SCENE_IMAGEMODULE_H
