//===- ImageFile.h - Images in files ----------------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_IMAGEFILE_H
#define PIKO_SCENE_IMAGEFILE_H

#include "Piko/Scene/Image.h"

#include <piko/scene.h>

#include <algorithm>
#include <cstdint>
#include <span>

namespace piko::render {

/// 8 bits of a linear value: floor(255 * clamp(value, 0, 1) + 0.5); NaN is 0.
inline uint8_t toByte(float value) {
  float clamped = value > 0 ? std::min(value, 1.0f) : 0.0f;
  return static_cast<uint8_t>(clamped * 255 + 0.5f);
}

/// Writes an image of `width` pixels a row, top row first, in the format that
/// the file's name ends in (PNG, EXR, PPM, TIFF, JPEG, ...: what OpenImageIO
/// knows; a build without it knows PNG). EXR, HDR and PFM hold linear floats,
/// EXR also alpha; all others hold 8 bits for each of r, g and b. The file
/// appears whole or not at all.
Result<Done> writeImage(const std::string &path, int width, int height,
                        std::span<const scene::Color> pixels);

/// Reads an image in any format that OpenImageIO knows, 8 bits as k / 255; one
/// channel becomes grey, and a missing alpha 1.
Result<Image> readImage(const std::string &path);

/// Whether writeImage knows the format of a file of this name: for a message
/// before the work starts rather than after it.
Result<Done> checkImageFormat(const std::string &path);

} // namespace piko::render

#endif // PIKO_SCENE_IMAGEFILE_H
