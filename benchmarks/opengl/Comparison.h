//===- Comparison.h - Whether two pictures are the same ---------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_BENCHMARKS_OPENGL_COMPARISON_H
#define PIKO_BENCHMARKS_OPENGL_COMPARISON_H

#include "Piko/Scene/Image.h"

#include <cstdint>
#include <string>

namespace piko::peer {

/// A PNG file of 8 bits for each channel, as all tools of Piko write. It is
/// read here because a machine with a card may lack OpenImageIO. The errors
/// name the file.
render::Result<render::Image> readPNG(const std::string &path);

struct Comparison {
  int64_t differing = 0; ///< pixels beyond the tolerance in r, g or b
  int largest = 0;       ///< difference, of 255
};

/// By how much of 255 a pixel may be off: what two orders of rounding give.
inline constexpr int tolerance = 2;

/// Of images of one size.
Comparison compare(const render::Image &reference, const render::Image &image);

} // namespace piko::peer

#endif // PIKO_BENCHMARKS_OPENGL_COMPARISON_H
