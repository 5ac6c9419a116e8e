//===- coverage.h - Which pixels a triangle covers ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Exact coverage in integers. Corners lie on a grid of 1/256 pixel; pixel
// (x, y) is covered if its centre (x + 1/2, y + 1/2) is inside, and a centre
// on an edge belongs to the triangle that has it as a top or a left edge. So
// triangles that share an edge leave no hole and draw no pixel twice.
//
// Coordinates are below 2^29 + 2^24 in magnitude, which clip.h's guard band
// ensures for images of up to 65536 pixels a side; differences then fit into 32
// bits, and edge functions are below 2^62. With 10 bits below a pixel, so it is
// up to 16384 pixels a side.
//
//===----------------------------------------------------------------------===//
#ifndef COMMON_COVERAGE_H
#define COMMON_COVERAGE_H

#include <piko.h>

namespace raster {

#ifndef SUBPIXEL_BITS
#define SUBPIXEL_BITS 8
#endif
constexpr int subpixelBits = SUBPIXEL_BITS;
static_assert(subpixelBits >= 1 && subpixelBits <= 10,
              "guard band and edge functions hold at most 10 bits");
constexpr int32_t subpixels = 1 << subpixelBits;

/// A point on the screen in 1/256 pixel, x to the right and y down.
struct Point {
  int32_t x, y;
};

/// The grid point nearest to a position in pixels.
inline Point snap(glm::vec2 pixels) {
  return {piko::toInt(piko::floor(pixels.x * subpixels + 0.5f)),
          piko::toInt(piko::floor(pixels.y * subpixels + 0.5f))};
}

/// Twice the area of a triangle: positive if its corners run clockwise on the
/// screen (y points down).
template <class Int> inline Int areaOf(Point a, Point b, Point c) {
  return Int(b.x - a.x) * (c.y - a.y) - Int(b.y - a.y) * (c.x - a.x);
}

inline int64_t signedArea(Point a, Point b, Point c) {
  return areaOf<int64_t>(a, b, c);
}

/// The line through a and b as a function of the pixel: positive at the
/// centres of pixels to its right, seen along a -> b with y down.
template <class Int> struct BasicEdge {
  Int stepX, stepY; ///< its change from one pixel to the next
  Int first;        ///< its value at pixel (0, 0)
  Int least;        ///< from which value on a pixel is inside

  BasicEdge(Point a, Point b) {
    Int dx = Int(b.x) - a.x, dy = Int(b.y) - a.y;
    constexpr int32_t half = subpixels / 2;
    stepX = -dy * subpixels;
    stepY = dx * subpixels;
    first = dx * (half - a.y) - dy * (half - a.x);
    bool isTop = dy == 0 && dx > 0, isLeft = dy < 0;
    least = isTop || isLeft ? 0 : 1;
  }

  Int at(int x, int y) const { return first + stepX * x + stepY * y; }
  bool holds(Int value) const { return value >= least; }
};

/// The edges of a triangle whose corners run clockwise on the screen, each
/// numbered as the corner opposite to it.
template <class Int> struct BasicEdges {
  BasicEdge<Int> e0, e1, e2;

  BasicEdges(Point a, Point b, Point c) : e0(b, c), e1(c, a), e2(a, b) {}

  bool cover(int x, int y) const {
    Int least = (e0.at(x, y) - e0.least) | (e1.at(x, y) - e1.least) |
                (e2.at(x, y) - e2.least);
    return least >= 0; // none is negative
  }

  /// Which of the pixels (0, 0), (1, 0), (0, 1) and (1, 1) are covered: bits 0
  /// to 3.
  uint32_t coveredOfFour() const {
    return uint32_t(cover(0, 0)) | uint32_t(cover(1, 0)) << 1 |
           uint32_t(cover(0, 1)) << 2 | uint32_t(cover(1, 1)) << 3;
  }
};

using Edges = BasicEdges<int64_t>;
/// For triangles whose corners are near pixel (0, 0), and pixels there.
using NearEdges = BasicEdges<int32_t>;

/// Whether a point is near enough to pixel (0, 0) for NearEdges: products of
/// two differences stay below 2^29.
inline bool isNear(Point p) {
  constexpr uint32_t reach = 1 << 13;
  return (uint32_t(p.x) + reach <= 2 * reach) &
         (uint32_t(p.y) + reach <= 2 * reach);
}

/// Pixels from lo to hi, both included; empty if hi is below lo.
struct PixelBox {
  glm::ivec2 lo, hi;

  bool isEmpty() const { return hi.x < lo.x || hi.y < lo.y; }
};

/// The pixels whose centres lie between the corners lo and hi.
inline PixelBox pixelsBetween(Point lo, Point hi) {
  constexpr int32_t half = subpixels / 2;
  return {
      {(lo.x + half - 1) >> subpixelBits, (lo.y + half - 1) >> subpixelBits},
      {(hi.x - half) >> subpixelBits, (hi.y - half) >> subpixelBits}};
}

} // namespace raster

#endif // COMMON_COVERAGE_H
