//===- bezier.h - Points of bicubic Bezier patches ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A point of a patch depends on the patch and the parameters alone, and a
// point of its border on the border's four control points alone. A curve that
// is reversed has the same points, bit by bit: each formula is the same with
// the ends of the curve exchanged, and parameters are dyadic, so that 1 - t is
// exact. So neighbours have the same points on a common border.
//
//===----------------------------------------------------------------------===//
#ifndef REYES_BEZIER_H
#define REYES_BEZIER_H

#include <piko.h>
#include <piko/scene.h>

namespace reyes {

using piko::scene::Patch;

/// Parameters count steps of 2^-24 from 0 to 1, all of which floats have.
using Parameter = int32_t;
constexpr int parameterBits = 24;
constexpr Parameter whole = 1 << parameterBits;

inline float toFloat(Parameter t) { return float(t) * (1.0f / float(whole)); }

/// A cubic Bezier curve.
struct Curve {
  glm::vec3 points[4];
};

/// What a value of a cubic holds of the four control points.
struct Weights {
  float w0, w1, w2, w3;

  /// Of the curve's blossom at (a, a, b). That at (t, t, t) is the point at t,
  /// and those at (a, a, a), (a, a, b), (a, b, b), (b, b, b) are the control
  /// points of the curve from a to b.
  Weights(Parameter a, Parameter b) {
    float x = toFloat(a), y = toFloat(b);
    float fromX = toFloat(whole - a), fromY = toFloat(whole - b);
    float both = 2 * (x * fromX);
    w0 = (fromX * fromX) * fromY;
    w1 = both * fromY + (fromX * fromX) * y;
    w2 = both * y + (x * x) * fromY;
    w3 = (x * x) * y;
  }

  glm::vec3 of(const Curve &c) const {
    return (w0 * c.points[0] + w3 * c.points[3]) +
           (w1 * c.points[1] + w2 * c.points[2]);
  }
};

/// What a derivative holds of the differences of the control points.
struct SlopeWeights {
  float w0, w1, w2;

  explicit SlopeWeights(Parameter t) {
    float x = toFloat(t), fromX = toFloat(whole - t);
    w0 = fromX * fromX;
    w1 = 2 * (x * fromX);
    w2 = x * x;
  }

  /// A third of the derivative.
  glm::vec3 of(const Curve &c) const {
    return w0 * (c.points[1] - c.points[0]) + w1 * (c.points[2] - c.points[1]) +
           w2 * (c.points[3] - c.points[2]);
  }
};

/// The part of a curve from a to b.
inline Curve partOf(const Curve &c, Parameter a, Parameter b) {
  return {{Weights(a, a).of(c), Weights(a, b).of(c), Weights(b, a).of(c),
           Weights(b, b).of(c)}};
}

/// The row i of control points, along v.
inline Curve rowOf(const Patch &p, int i) {
  return {{p.points[4 * i], p.points[4 * i + 1], p.points[4 * i + 2],
           p.points[4 * i + 3]}};
}
/// The column j of control points, along u.
inline Curve columnOf(const Patch &p, int j) {
  return {{p.points[j], p.points[4 + j], p.points[8 + j], p.points[12 + j]}};
}

/// The curve along v with weights of u, and the other way round.
template <class AnyWeights>
inline Curve alongV(const Patch &p, const AnyWeights &u) {
  return {{u.of(columnOf(p, 0)), u.of(columnOf(p, 1)), u.of(columnOf(p, 2)),
           u.of(columnOf(p, 3))}};
}
template <class AnyWeights>
inline Curve alongU(const Patch &p, const AnyWeights &v) {
  return {{v.of(rowOf(p, 0)), v.of(rowOf(p, 1)), v.of(rowOf(p, 2)),
           v.of(rowOf(p, 3))}};
}

} // namespace reyes

#endif // REYES_BEZIER_H
