//===- dicing.h - How finely a piece of a patch is diced ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A piece is a dyadic rectangle of a patch's parameters. It is diced into a
// grid of 2^n by 2^m cells with n, m <= gridBits, or split if that is too
// coarse.
//
// Pieces meet at lines: curves of constant u or v from border to border of a
// patch. What a line is diced into depends on the line alone. It is halved
// until 2^gridBits equal segments are enough for each part; each part then has
// the smallest power of two that is. A grid moves its corners on a line to the
// nearest ends of such segments, wherever the piece itself ends. So all pieces
// and patches that meet at a line leave the same polyline there, and no crack.
//
//===----------------------------------------------------------------------===//
#ifndef REYES_DICING_H
#define REYES_DICING_H

#include "bezier.h"

namespace reyes {

/// A grid has at most 2^gridBits cells a side.
constexpr int gridBits = 4;
/// How often a patch is halved along u, and along v, at most.
constexpr int maxHalvings = parameterBits - gridBits;
/// The logarithm of a number of segments that is not known.
constexpr int tooMany = 99;

/// Pieces nearer to the eye than half the near plane are left out, and reach
/// nowhere nearer than a quarter of it.
constexpr float leftOut = 0.5f, nearest = 0.25f;

/// Part of a patch.
struct Piece {
  int32_t patch;
  Parameter u, v; ///< where it begins
  int32_t halvingsU, halvingsV;

  Parameter endU() const { return u + (whole >> halvingsU); }
  Parameter endV() const { return v + (whole >> halvingsV); }
};

/// The smallest n >= 0 with 2^n >= x; tooMany for NaN.
inline int ceilLog2(float x) {
  if (x <= 1.0f)
    return 0;
  if (!(x < 1e30f))
    return tooMany;
  uint32_t bits = __builtin_bit_cast(uint32_t, x);
  return int(bits >> 23) - 127 + ((bits & 0x7fffffu) != 0);
}

/// A view of patches on the screen, and how long edges may be there.
struct View {
  glm::mat4 toClip;
  glm::vec2 half; ///< the image's size in pixels, halved
  float rate;     ///< in pixels
  float least;    ///< w of the nearest points

  /// The rate is kept in a range in which grids do not outgrow integers.
  View(const piko::scene::Camera &camera, glm::ivec2 size, float rate)
      : toClip(camera.viewProjection), half(glm::vec2(size) * 0.5f),
        rate(piko::clamp(rate, 0.0625f, 64.0f)), least(nearest * camera.nearZ) {
  }

  glm::vec4 project(glm::vec3 p) const { return toClip * glm::vec4(p, 1); }
};

/// Bounds the length on the screen of curves with given control points: the
/// derivative of x / w is (x' - s w' - (x / w - s) w') / w for any s. All
/// derivatives lie between three times the differences of control points.
class LengthBound {
public:
  /// `ends` is twice the reference point s: the sum of two points' places.
  explicit LengthBound(glm::vec2 ends) : reference(0.5f * ends) {}

  void addPoint(glm::vec4 p) {
    leastW = piko::min(leastW, p.w);
    spread = glm::max(spread, glm::abs(glm::vec2(p) / p.w - reference));
  }
  void addDifference(glm::vec4 d) {
    slope = glm::max(slope, glm::abs(glm::vec2(d) - reference * d.w));
    slopeW = piko::max(slopeW, piko::abs(d.w));
  }

  /// How many segments are short enough, as a logarithm.
  int segments(const View &view) const {
    if (!(leastW >= view.least))
      return tooMany;
    glm::vec2 speed = (slope + spread * slopeW) * view.half * (3.0f / leastW);
    return ceilLog2(piko::sqrt(glm::dot(speed, speed)) / view.rate);
  }

private:
  glm::vec2 reference;
  glm::vec2 spread{0}, slope{0};
  float slopeW = 0, leastW = 1e30f;
};

/// How many segments suffice for a curve, as a logarithm; the same for the
/// reversed curve.
inline int segmentsOf(const Curve &c, const View &view) {
  glm::vec4 p0 = view.project(c.points[0]), p1 = view.project(c.points[1]);
  glm::vec4 p2 = view.project(c.points[2]), p3 = view.project(c.points[3]);
  LengthBound bound(glm::vec2(p0) / p0.w + glm::vec2(p3) / p3.w);
  bound.addPoint(p0);
  bound.addPoint(p1);
  bound.addPoint(p2);
  bound.addPoint(p3);
  bound.addDifference(p1 - p0);
  bound.addDifference(p2 - p1);
  bound.addDifference(p3 - p2);
  return bound.segments(view);
}

/// The length, as a parameter, of the segments of a line around its part of
/// that many halvings that begins at t.
inline Parameter segmentLength(const Curve &line, Parameter t, int halvings,
                               const View &view) {
  for (int i = 0;; ++i) {
    Parameter length = whole >> i, begin = t & ~(length - 1);
    int n = segmentsOf(partOf(line, begin, begin + length), view);
    if (n <= gridBits)
      return length >> n;
    if (i == halvings) // a piece that could not be split
      return length >> gridBits;
  }
}

/// The multiple of a power of two that is nearest.
inline Parameter snapTo(Parameter length, Parameter t) {
  return (t + (length >> 1)) & ~(length - 1);
}

/// The control points of a piece in clip space.
struct Hull {
  glm::vec4 points[16];

  Hull(const Patch &patch, const Piece &piece, const View &view) {
    Parameter u0 = piece.u, u1 = piece.endU(), v0 = piece.v, v1 = piece.endV();
    Curve rows[4] = {
        partOf(alongV(patch, Weights(u0, u0)), v0, v1),
        partOf(alongV(patch, Weights(u0, u1)), v0, v1),
        partOf(alongV(patch, Weights(u1, u0)), v0, v1),
        partOf(alongV(patch, Weights(u1, u1)), v0, v1),
    };
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        points[4 * i + j] = view.project(rows[i].points[j]);
  }

  /// Whether all of it, and the segments that a line may have beyond, are
  /// outside of one side of the view.
  bool isOutside(const View &view) const {
    glm::vec2 reach = 1.0f + (view.rate + 1.0f) / view.half;
    bool left = true, right = true, below = true, above = true, before = true;
    for (int i = 0; i < 16; ++i) {
      glm::vec4 p = points[i];
      left &= p.x < -p.w * reach.x;
      right &= p.x > p.w * reach.x;
      below &= p.y < -p.w * reach.y;
      above &= p.y > p.w * reach.y;
      before &= p.w < view.least * (leftOut / nearest);
    }
    return left || right || below || above || before;
  }

  /// How many segments suffice for all curves along u or along v.
  int segmentsU(const View &view) const { return segments<4, 1>(view); }
  int segmentsV(const View &view) const { return segments<1, 4>(view); }

private:
  template <int Along, int Across> int segments(const View &view) const {
    LengthBound bound(glm::vec2(points[0]) / points[0].w +
                      glm::vec2(points[15]) / points[15].w);
    for (int i = 0; i < 16; ++i)
      bound.addPoint(points[i]);
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 3; ++i) {
        int first = Along * i + Across * j;
        bound.addDifference(points[first + Along] - points[first]);
      }
    return bound.segments(view);
  }
};

} // namespace reyes

#endif // REYES_DICING_H
