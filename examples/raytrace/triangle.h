//===- triangle.h - Where a ray meets a triangle --------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The watertight test of Woop, Benthin and Wald, "Watertight Ray/Triangle
// Intersection", JCGT 2(1), 2013. Space is sheared so that the ray runs along
// an axis from the origin; each corner is rounded there on its own, in the same
// way for all triangles that have it. Whether the origin is to the left of an
// edge is then decided without an error, so that no ray passes between two
// triangles that share the edge. A ray through an edge meets both.
//
//===----------------------------------------------------------------------===//
#ifndef RAYTRACE_TRIANGLE_H
#define RAYTRACE_TRIANGLE_H

#include <piko.h>
#include <piko/scene.h>

namespace raytrace {

/// Where a ray first meets the mesh: at origin + t * direction.
template <class Distance> struct HitAt {
  Distance t;
  int32_t triangle = -1; ///< its index; -1 if there is none
  glm::vec3 weight;      ///< of the triangle's corners; the sum is 1
};
using Hit = HitAt<float>;

/// A ray as the test wants it. The largest component of the direction, in
/// magnitude, must be finite and normal.
template <class Distance> class ShearedRayTo {
public:
  using Hit = HitAt<Distance>;

  ShearedRayTo(glm::vec3 origin, glm::vec3 direction) : origin(origin) {
    glm::vec3 size = glm::abs(direction);
    z = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    x = z == 2 ? 0 : z + 1;
    y = z == 0 ? 2 : z - 1;
    length = direction[z];
    shearX = direction[x] / length;
    shearY = direction[y] / length;
  }

  /// Puts the hit with a triangle into `nearest`, and returns true, if there is
  /// one with 0 < t < nearest.t; or t = nearest.t and a smaller index.
  bool intersect(const piko::scene::BvhTriangle &triangle, Hit &nearest) const {
    Corner a = shear(triangle.corner[0]);
    Corner b = shear(triangle.corner[1]);
    Corner c = shear(triangle.corner[2]);
    // Products of floats are rounded to floats, which may make two of them
    // equal, but never turns them around.
    float u = c.x * b.y - c.y * b.x;
    float v = a.x * c.y - a.y * c.x;
    float w = b.x * a.y - b.y * a.x;
    // False if two signs differ, and for NaN.
    if (!((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)))
      return false;
    // In doubles the products are exact, and the signs with them, also of what
    // was 0. And t does not leave the triangle, however narrow it is.
    double du = double(c.x) * double(b.y) - double(c.y) * double(b.x);
    double dv = double(a.x) * double(c.y) - double(a.y) * double(c.x);
    double dw = double(b.x) * double(a.y) - double(b.y) * double(a.x);
    if (!((du >= 0 && dv >= 0 && dw >= 0) || (du <= 0 && dv <= 0 && dw <= 0)))
      return false;
    double sum = du + dv + dw;
    if (sum == 0) // it is seen from the side, or has no area
      return false;
    double distance = du * double(a.z) + dv * double(b.z) + dw * double(c.z);
    Distance t = Distance(distance / (sum * double(length)));
    if (!(t > 0 && t <= nearest.t))
      return false;
    if (t == nearest.t && nearest.triangle < triangle.index)
      return false;
    nearest.t = t;
    nearest.triangle = triangle.index;
    nearest.weight = {float(du / sum), float(dv / sum), float(dw / sum)};
    return true;
  }

private:
  struct Corner {
    float x, y, z;
  };

  Corner shear(const float (&corner)[3]) const {
    float depth = corner[z] - origin[z];
    return {corner[x] - origin[x] - shearX * depth,
            corner[y] - origin[y] - shearY * depth, depth};
  }

  glm::vec3 origin;
  int x, y, z; ///< z is where the direction is longest
  float length, shearX, shearY;
};
using ShearedRay = ShearedRayTo<float>;

} // namespace raytrace

#endif // RAYTRACE_TRIANGLE_H
