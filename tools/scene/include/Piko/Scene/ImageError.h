//===- ImageError.h - How far an image is from another one ------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_IMAGEERROR_H
#define PIKO_SCENE_IMAGEERROR_H

#include "Piko/Scene/Image.h"

#include <cstdint>

namespace piko::render {

/// The differences between two images, of r, g and b as a display shows them:
/// clamped to [0, 1], not finite ones as 0.
struct ImageError {
  double largest = 0;    ///< absolute difference
  double mean = 0;       ///< absolute difference
  double rms = 0;        ///< root of the mean square
  double p99 = 0;        ///< 99 % of pixels differ by at most this
  double psnr = 0;       ///< in dB; infinite for equal images
  double flip = 0;       ///< mean of the FLIP map
  int64_t differing = 0; ///< pixels that differ at all
  int64_t notFinite = 0; ///< pixels of the image with NaN or infinities
};

/// How many pixels a degree of the field of view has: of a display of 3840
/// pixels, 0.7 m wide, seen from 0.7 m.
inline constexpr double usualPixelsPerDegree = 67.0206;

/// FLIP, which predicts the difference that an observer notices when he flips
/// between two images: 0 to 1 for each pixel, in rows. (Andersson, Nilsson,
/// Akenine-Moeller, Oskarsson, Astrom, Fairchild: FLIP: A Difference Evaluator
/// for Alternating Images. Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020;
/// with the constants of its table 1, for images of low dynamic range.) Values
/// are taken as encoded in sRGB.
Result<std::vector<float>>
computeFlip(const Image &reference, const Image &image,
            double pixelsPerDegree = usualPixelsPerDegree);

/// An error if the images differ in size, or have no pixels. `flip`, if any,
/// becomes the map.
Result<ImageError> compareImages(const Image &reference, const Image &image,
                                 double pixelsPerDegree = usualPixelsPerDegree,
                                 std::vector<float> *flip = nullptr);

/// The same without FLIP, which takes most of the time.
Result<ImageError> compareColors(const Image &reference, const Image &image);

} // namespace piko::render

#endif // PIKO_SCENE_IMAGEERROR_H
