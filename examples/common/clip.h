//===- clip.h - From clip space to a polygon on the screen ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A triangle in clip space becomes a convex polygon of at most nine corners on
// the screen: cut at the near and the far plane, so that w is positive and
// nothing is drawn beyond, and at a guard band far outside the image, so that
// coverage.h's integers do not overflow. Nearly all triangles need no cut.
//
// A cut depends on nothing but the two ends of the edge that is cut, always
// seen from the inside, so that neighbours are cut at the same point. It is
// made in double precision: in a narrow view an edge may be 10^10 times as long
// as the image is wide, of which floats resolve no pixel.
//
//===----------------------------------------------------------------------===//
#ifndef COMMON_CLIP_H
#define COMMON_CLIP_H

#include "coverage.h"

namespace raster {

/// The guard band reaches this many times as far as the image from its centre.
constexpr float guardBand = 64.0f;
/// Triangles with larger clip coordinates than this, or NaN, are dropped.
constexpr float largestCoordinate = 1e25f;

/// A corner in clip space, and how much of the triangle's three corners it
/// holds.
struct ClipCorner {
  glm::vec4 position;
  glm::vec3 weight;
};

/// The same while it is cut.
struct PreciseCorner {
  glm::dvec4 position;
  glm::vec3 weight;
};

/// The planes to clip at: near and far, then the guard band.
constexpr int clipPlanes = 6;

/// How far inside of a plane p is; negative outside.
inline double distanceTo(int plane, glm::dvec4 p) {
  constexpr double reach = guardBand;
  switch (plane) {
  case 0:
    return p.z + p.w;
  case 1:
    return p.w - p.z;
  case 2:
    return reach * p.w - p.x;
  case 3:
    return reach * p.w + p.x;
  case 4:
    return reach * p.w - p.y;
  default:
    return reach * p.w + p.y;
  }
}

inline bool isInGuardBand(glm::vec4 p) {
  float reach = guardBand * p.w;
  return p.x <= reach && -p.x <= reach && p.y <= reach && -p.y <= reach;
}

inline bool isInside(glm::vec4 p) {
  return p.z + p.w >= 0 && p.z <= p.w && isInGuardBand(p);
}

inline bool isUsable(glm::vec4 p) {
  return glm::abs(p.x) <= largestCoordinate &&
         glm::abs(p.y) <= largestCoordinate &&
         glm::abs(p.z) <= largestCoordinate &&
         glm::abs(p.w) <= largestCoordinate; // false for NaN
}

/// Whether all three points are on the far side of one side of the view.
inline bool isOutOfView(glm::vec4 a, glm::vec4 b, glm::vec4 c) {
  return (a.x < -a.w && b.x < -b.w && c.x < -c.w) ||
         (a.x > a.w && b.x > b.w && c.x > c.w) ||
         (a.y < -a.w && b.y < -b.w && c.y < -c.w) ||
         (a.y > a.w && b.y > b.w && c.y > c.w) ||
         (a.z < -a.w && b.z < -b.w && c.z < -c.w) ||
         (a.z > a.w && b.z > b.w && c.z > c.w);
}

/// Where the edge from a corner inside to one outside meets a plane; the
/// arguments are their distances.
inline PreciseCorner cut(const PreciseCorner &in, const PreciseCorner &out,
                         double inside, double outside) {
  double t = inside / (inside - outside);
  return {in.position + (out.position - in.position) * t,
          in.weight + (out.weight - in.weight) * float(t)};
}

constexpr int maxCorners = 3 + clipPlanes;

/// Clips the convex polygon in the first `count` corners of `polygon` and
/// returns its new number of corners (Sutherland and Hodgman 1974).
inline int clipPolygon(ClipCorner (&polygon)[maxCorners], int count) {
  PreciseCorner corners[maxCorners], kept[maxCorners];
  for (int i = 0; i < count; ++i)
    corners[i] = {polygon[i].position, polygon[i].weight};
  for (int plane = 0; plane < clipPlanes; ++plane) {
    int keptCount = 0;
    for (int i = 0; i < count; ++i) {
      PreciseCorner a = corners[i], b = corners[i + 1 == count ? 0 : i + 1];
      double da = distanceTo(plane, a.position);
      double db = distanceTo(plane, b.position);
      if (da >= 0 && keptCount < maxCorners)
        kept[keptCount++] = a;
      if ((da >= 0) != (db >= 0) && keptCount < maxCorners)
        kept[keptCount++] = da >= 0 ? cut(a, b, da, db) : cut(b, a, db, da);
    }
    for (int i = 0; i < keptCount; ++i)
      corners[i] = kept[i];
    count = keptCount;
  }
  for (int i = 0; i < count; ++i)
    polygon[i] = {glm::vec4(corners[i].position), corners[i].weight};
  return count;
}

/// A point in normalised device coordinates on an image of `size` pixels.
inline Point toPoint(glm::vec2 ndc, glm::ivec2 size) {
  glm::vec2 half = glm::vec2(size) * 0.5f;
  // A cut leaves a corner on the guard band or a rounding error beyond.
  ndc = glm::clamp(ndc, -guardBand, guardBand);
  return snap({half.x + ndc.x * half.x, half.y - ndc.y * half.y});
}

/// A pixel that a polygon covers.
struct Sample {
  glm::ivec2 pixel;
  float depth;      ///< z / w, from -1 at the near plane to 1 at the far one
  glm::vec3 weight; ///< of the triangle's corners, perspective-correct
};

/// A convex polygon on the screen: a fan of triangles about its corner 0.
class ScreenPolygon {
public:
  /// Projects a triangle in clip space to an image of `size` pixels. Nothing
  /// is left of one that is out of view, degenerate, not finite, or, if
  /// `cullBackFaces`, seen from behind.
  ScreenPolygon(glm::vec4 a, glm::vec4 b, glm::vec4 c, glm::ivec2 size,
                bool cullBackFaces) {
    if (!isUsable(a) || !isUsable(b) || !isUsable(c) || isOutOfView(a, b, c))
      return;
    ClipCorner corners[maxCorners];
    corners[0] = {a, {1, 0, 0}};
    corners[1] = {b, {0, 1, 0}};
    corners[2] = {c, {0, 0, 1}};
    int cornerCount = 3;
    if (!isInside(a) || !isInside(b) || !isInside(c))
      cornerCount = clipPolygon(corners, cornerCount);
    for (int i = 0; i < cornerCount; ++i)
      if (!project(i, corners[i], size))
        return;
    int64_t area = 0;
    for (int i = 1; i + 1 < cornerCount; ++i)
      area += signedArea(points[0], points[i], points[i + 1]);
    // Counterclockwise is the front; in the image y points down.
    if (area == 0 || (cullBackFaces && area > 0))
      return;
    isClockwise = area > 0;
    count = cornerCount;
  }

  /// The pixels among which all covered ones are.
  PixelBox box() const {
    if (count == 0)
      return {{0, 0}, {-1, -1}};
    Point lo = points[0], hi = points[0];
    for (int i = 1; i < count; ++i) {
      Point p = points[i];
      lo = {p.x < lo.x ? p.x : lo.x, p.y < lo.y ? p.y : lo.y};
      hi = {p.x > hi.x ? p.x : hi.x, p.y > hi.y ? p.y : hi.y};
    }
    return pixelsBetween(lo, hi);
  }

  /// Calls draw(Sample) once for each covered pixel of those that `pixels(lo,
  /// hi, f)`, a stage's parallelForPixels, calls f for.
  template <class Pixels, class Draw>
  void rasterize(Pixels pixels, Draw draw) const {
    PixelBox area = box();
    for (int part = 1; part + 1 < count; ++part) {
      // The part's corners, clockwise.
      int i = isClockwise ? part : part + 1, j = isClockwise ? part + 1 : part;
      int64_t partArea = signedArea(points[0], points[i], points[j]);
      if (partArea <= 0) // empty, or a fold of less than 1/256 pixel
        continue;
      Edges edges(points[0], points[i], points[j]);
      pixels(area.lo, area.hi, [&](glm::ivec2 p) {
        int64_t v0 = edges.e0.at(p.x, p.y), v1 = edges.e1.at(p.x, p.y),
                v2 = edges.e2.at(p.x, p.y);
        if (edges.e0.holds(v0) && edges.e1.holds(v1) && edges.e2.holds(v2))
          draw(interpolate(p, i, j, {v0, v1, v2}, partArea));
      });
    }
  }

private:
  /// Corner i on the screen; false if it has no place there.
  bool project(int i, const ClipCorner &corner, glm::ivec2 size) {
    glm::vec4 p = corner.position;
    if (!(p.w > 0))
      return false;
    float inverse = 1 / p.w;
    points[i] = toPoint(glm::vec2(p) * inverse, size);
    depths[i] = p.z * inverse;
    shares[i] = {corner.weight * inverse, inverse};
    return true;
  }

  /// What the polygon is at a pixel of the part with corners 0, i and j, from
  /// the values of its edge functions.
  Sample interpolate(glm::ivec2 pixel, int i, int j, glm::i64vec3 edges,
                     int64_t partArea) const {
    glm::vec3 v = glm::vec3(edges) * (1.0f / float(partArea));
    float depth = v.x * depths[0] + v.y * depths[i] + v.z * depths[j];
    glm::vec4 share = v.x * shares[0] + v.y * shares[i] + v.z * shares[j];
    return {pixel, depth, glm::vec3(share) * (1 / share.w)};
  }

  int count = 0;
  bool isClockwise = false;
  Point points[maxCorners];
  float depths[maxCorners];     ///< z / w
  glm::vec4 shares[maxCorners]; ///< weight / w and 1 / w
};

} // namespace raster

#endif // COMMON_CLIP_H
