//===- Image.h - An image in memory -----------------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_IMAGE_H
#define PIKO_SCENE_IMAGE_H

#include "Piko/Scene/Result.h"

#include <piko/scene.h>

#include <vector>

namespace piko::render {

/// Rows of pixels, top row first.
struct Image {
  int width = 0, height = 0;
  std::vector<scene::Color> pixels;
};

} // namespace piko::render

#endif // PIKO_SCENE_IMAGE_H
