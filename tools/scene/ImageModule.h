//===- ImageModule.h - OpenImageIO, loaded when needed ----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Its errors say why alone; ImageFile.cpp says what of which file.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_SCENE_IMAGEMODULE_H
#define PIKO_TOOLS_SCENE_IMAGEMODULE_H

#include "Piko/Scene/ImageFile.h"

#include <cctype>
#include <filesystem>
#include <string>
#include <vector>

namespace piko::render {

struct ImageFunctions {
  /// Whether there is a format of that extension (lowercase, without a dot).
  bool (*hasFormat)(const std::string &extension);
  /// A file's content in the format of an extension.
  Result<std::string> (*encode)(const std::string &extension, int width,
                                int height,
                                std::span<const scene::Color> pixels);
  Result<Image> (*read)(const std::string &path);
};

/// The extension, in lowercase and without the dot.
inline std::string extensionOf(const std::string &path) {
  std::string extension = std::filesystem::path(path).extension().string();
  if (!extension.empty())
    extension.erase(0, 1);
  for (char &c : extension)
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

/// 8 bits for each of r, g and b of each pixel.
inline std::vector<uint8_t> toBytes(std::span<const scene::Color> pixels) {
  std::vector<uint8_t> bytes;
  bytes.reserve(pixels.size() * 3);
  for (const scene::Color &pixel : pixels)
    for (int channel = 0; channel < 3; ++channel)
      bytes.push_back(toByte(pixel.rgba[channel]));
  return bytes;
}

/// The module's one symbol, and the file it is in.
inline constexpr const char *imageModuleSymbol = "piko_image_functions";
inline constexpr const char *imageModuleFile = "libPikoImage.so";

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_IMAGEMODULE_H
