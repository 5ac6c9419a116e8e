//===- corner.h - Triangles from vertices that were projected once --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What triangles share of their way to the screen is computed for each vertex:
// where it is on the screen, and which planes it is outside of. A triangle that
// needs no clipping is then a few integers; clip.h has the others, for which
// `clip(i)` gives the place of corner i in clip space. It is not kept, because
// hardly any triangle needs it.
//
//===----------------------------------------------------------------------===//
#ifndef COMMON_CORNER_H
#define COMMON_CORNER_H

#include "clip.h"

#include <utility>

namespace raster {

/// Sides of the view, and what keeps a vertex from being used as it is.
enum Outside : uint32_t {
  outsideView = 63,   ///< left, right, below, above, near, far
  outsideDepth = 48,  ///< near, far
  outsideGuard = 64,  ///< beyond the guard band, or a plane of depth
  outsideRange = 128, ///< too large, or not a number
};

/// A vertex on the screen, where one that is outside the guard band has no
/// place.
struct ScreenVertex {
  Point at;
  float depth;   ///< z / w
  float inverse; ///< 1 / w
  uint32_t outside;
};

/// A place in clip space on an image of `size` pixels.
inline ScreenVertex toScreen(glm::vec4 clip, glm::ivec2 size) {
  ScreenVertex v{};
  if (!isUsable(clip)) {
    v.outside = outsideRange;
    return v;
  }
  float w = clip.w;
  v.outside = uint32_t(clip.x < -w) | uint32_t(clip.x > w) << 1 |
              uint32_t(clip.y < -w) << 2 | uint32_t(clip.y > w) << 3 |
              uint32_t(clip.z < -w) << 4 | uint32_t(clip.z > w) << 5;
  if ((v.outside & outsideDepth) || !isInGuardBand(clip) || !(w > 0)) {
    v.outside |= outsideGuard;
    return v;
  }
  v.inverse = 1 / w;
  v.at = toPoint(glm::vec2(clip) * v.inverse, size);
  v.depth = clip.z * v.inverse;
  return v;
}

/// Whether nothing of a triangle can be seen, or it has no place.
inline bool isGone(const ScreenVertex &a, const ScreenVertex &b,
                   const ScreenVertex &c) {
  return (a.outside & b.outside & c.outside & outsideView) ||
         ((a.outside | b.outside | c.outside) & outsideRange);
}

inline bool needsClipping(const ScreenVertex &a, const ScreenVertex &b,
                          const ScreenVertex &c) {
  return (a.outside | b.outside | c.outside) & outsideGuard;
}

/// The pixels of the image among which a triangle's are; none of one that is
/// out of view, degenerate, not finite, or, if `cullBackFaces`, seen from
/// behind.
template <class Clip>
inline PixelBox boxOf(const ScreenVertex &a, const ScreenVertex &b,
                      const ScreenVertex &c, Clip clip, glm::ivec2 size,
                      bool cullBackFaces) {
  constexpr PixelBox none = {{0, 0}, {-1, -1}};
  if (isGone(a, b, c))
    return none;
  PixelBox box;
  if (needsClipping(a, b, c)) {
    box = ScreenPolygon(clip(0), clip(1), clip(2), size, cullBackFaces).box();
  } else {
    int64_t area = signedArea(a.at, b.at, c.at);
    if (area == 0 || (cullBackFaces && area > 0))
      return none;
    Point lo = {glm::min(glm::min(a.at.x, b.at.x), c.at.x),
                glm::min(glm::min(a.at.y, b.at.y), c.at.y)};
    Point hi = {glm::max(glm::max(a.at.x, b.at.x), c.at.x),
                glm::max(glm::max(a.at.y, b.at.y), c.at.y)};
    box = pixelsBetween(lo, hi);
  }
  return {glm::max(box.lo, 0), glm::min(box.hi, size - 1)};
}

/// `box`, from boxOf(), without rows and columns at its sides of which the
/// triangle covers nothing, if it is at most 2 by 2 pixels, of which
/// many triangles cover none.
inline PixelBox coveredPart(const ScreenVertex &a, const ScreenVertex &b,
                            const ScreenVertex &c, const PixelBox &box) {
  // Relative to the box, which makes small numbers of those of small triangles.
  auto place = [&](Point p) -> Point {
    return {p.x - box.lo.x * subpixels, p.y - box.lo.y * subpixels};
  };
  Point first = place(a.at), second = place(b.at), third = place(c.at);
  if (box.hi.x - box.lo.x > 1 || box.hi.y - box.lo.y > 1 ||
      needsClipping(a, b, c) || !isNear(first) || !isNear(second) ||
      !isNear(third))
    return box;
  if (signedArea(first, second, third) < 0)
    std::swap(second, third);
  // No branch on any of this would be foreseen.
  uint32_t columns = (box.lo.x <= box.hi.x ? 0b0101u : 0u) |
                     (box.lo.x < box.hi.x ? 0b1010u : 0u);
  uint32_t rows = (box.lo.y <= box.hi.y ? 0b0011u : 0u) |
                  (box.lo.y < box.hi.y ? 0b1100u : 0u);
  uint32_t covered =
      NearEdges(first, second, third).coveredOfFour() & columns & rows;
  PixelBox part = {box.lo, box.lo};
  part.lo.x += covered & 0b0101 ? 0 : 1;
  part.lo.y += covered & 0b0011 ? 0 : 1;
  part.hi.x += covered & 0b1010 ? 1 : covered ? 0 : -1;
  part.hi.y += covered & 0b1100 ? 1 : 0;
  return part;
}

/// Calls draw(Sample) once for each pixel in `box` that a triangle covers and
/// that is not below `lo` nor at `hi` or beyond. `box` is from boxOf() or
/// coveredPart(). `pixels(lo, hi, f)`, the stage's parallelForPixels, calls f
/// for those of a triangle that is clipped.
template <class Clip, class Pixels, class Draw>
inline void rasterize(const ScreenVertex &a, const ScreenVertex &b,
                      const ScreenVertex &c, Clip clip, const PixelBox &box,
                      glm::ivec2 lo, glm::ivec2 hi, glm::ivec2 size,
                      bool cullBackFaces, Pixels pixels, Draw draw) {
  if (needsClipping(a, b, c)) {
    ScreenPolygon(clip(0), clip(1), clip(2), size, cullBackFaces)
        .rasterize(pixels, draw);
    return;
  }
  lo = glm::max(lo, box.lo);
  hi = glm::min(hi, box.hi + 1);
  int64_t area = signedArea(a.at, b.at, c.at);
  // Clockwise: a, b, c or a, c, b.
  bool turned = area < 0;
  ScreenVertex second = b, third = c;
  if (turned)
    std::swap(second, third);
  float scale = 1.0f / float(turned ? -area : area);
  // Relative to the first pixel, where most triangles end.
  auto place = [&](Point p) -> Point {
    return {p.x - lo.x * subpixels, p.y - lo.y * subpixels};
  };
  Edges edges(place(a.at), place(second.at), place(third.at));
  // Each pixel's values are those of the one before it and a step: iterations
  // that depend on one another, but do not multiply.
  int64_t row0 = edges.e0.first, row1 = edges.e1.first, row2 = edges.e2.first;
  for (int y = lo.y; y < hi.y; ++y, row0 += edges.e0.stepY,
           row1 += edges.e1.stepY, row2 += edges.e2.stepY) {
    int64_t e0 = row0, e1 = row1, e2 = row2;
    for (int x = lo.x; x < hi.x; ++x, e0 += edges.e0.stepX,
             e1 += edges.e1.stepX, e2 += edges.e2.stepX) {
      if (!edges.e0.holds(e0) || !edges.e1.holds(e1) || !edges.e2.holds(e2))
        continue;
      glm::vec3 v = glm::vec3(e0, e1, e2) * scale;
      glm::vec3 share = {v.x * a.inverse, v.y * second.inverse,
                         v.z * third.inverse};
      share *= 1 / (share.x + share.y + share.z);
      draw(Sample{{x, y},
                  v.x * a.depth + v.y * second.depth + v.z * third.depth,
                  turned ? glm::vec3(share.x, share.z, share.y) : share});
    }
  }
}

} // namespace raster

#endif // COMMON_CORNER_H
