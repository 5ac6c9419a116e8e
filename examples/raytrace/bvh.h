//===- bvh.h - The triangles near a ray -----------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Goes through a tree of boxes, near children first. No box is passed over that
// holds a hit, so what a ray hits does not depend on the tree. Let e = 2^-24,
// and m how far the mesh reaches from the ray's origin along any axis.
//
// * triangle.h rounds: a corner is up to 10 e m off across the ray, and up to
//   e m along it. Boxes are wider by 12 e m on each side.
// * The distance to a plane has three rounding errors. Distances to far planes
//   are made longer by more than that (Ize, "Robust BVH Ray Traversal", JCGT
//   2(2), 2013).
//
//===----------------------------------------------------------------------===//
#ifndef RAYTRACE_BVH_H
#define RAYTRACE_BVH_H

#include "triangle.h"

namespace raytrace {

using piko::scene::BvhNode;
using piko::scene::BvhTriangle;

constexpr float epsilon = 0x1p-24f;
/// A factor beyond all rounding errors of a distance.
constexpr float longer = 1 + 16 * epsilon;

/// A ray as boxes are tested with it.
class SlabRay {
public:
  SlabRay(glm::vec3 origin, glm::vec3 direction,
          const piko::scene::Bounds &mesh) {
    glm::vec3 reach =
        glm::max(glm::abs(mesh.lo - origin), glm::abs(mesh.hi - origin));
    float margin =
        12 * epsilon * piko::max(piko::max(reach.x, reach.y), reach.z);
    nearScale = 1.0f / direction; // of 0 it is infinite
    farScale = nearScale * longer;
    isForward = glm::greaterThan(nearScale, glm::vec3(0));
    // These sums are rounded, too.
    glm::vec3 wide = margin + 4 * epsilon * glm::abs(origin);
    originOfLo = origin + wide;
    originOfHi = origin - wide;
    float length2 = glm::dot(direction, direction);
    usable = length2 > 1e-36f && length2 < 1e36f && margin < 1e12f;
  }

  /// False if numbers are out of range or NaN.
  bool isUsable() const { return usable; }

  /// Where the ray enters child i of a node, between 0 and limit; INFINITY if
  /// it does not.
  float enter(const BvhNode &node, int i, float limit) const {
    const auto &b = node.bounds;
    glm::vec3 toLo = glm::vec3(b[0][i], b[1][i], b[2][i]) - originOfLo;
    glm::vec3 toHi = glm::vec3(b[3][i], b[4][i], b[5][i]) - originOfHi;
    glm::vec3 toNear = glm::mix(toHi, toLo, isForward) * nearScale;
    glm::vec3 toFar = glm::mix(toLo, toHi, isForward) * farScale;
    float in = 0, out = limit;
    for (int k = 0; k < 3; ++k) {
      // NaN, which is 0 times infinity in a plane of the box, changes nothing.
      in = in < toNear[k] ? toNear[k] : in;
      out = toFar[k] < out ? toFar[k] : out;
    }
    return in <= out ? in : INFINITY;
  }

private:
  glm::vec3 originOfLo, originOfHi, nearScale, farScale;
  glm::bvec3 isForward;
  bool usable;
};

/// The nearest hit with 0 < t < limit; of equally near ones that of the
/// smallest index. If `anyHit`, one of the hits. None if the direction is
/// shorter than 1e-18 or longer than 1e18, or the mesh is farther away.
///
/// `Test` says how a ray meets a triangle, as ShearedRay does.
///
/// The rays of a packet go through the tree together: `any` says whether one of
/// them passes true, and `least` gives the least of what they pass. For a
/// single ray both give back what they take.
template <class Test = ShearedRay, class Any, class Least>
typename Test::Hit findHit(glm::vec3 origin, glm::vec3 direction, float limit,
                           bool anyHit, const piko::scene::Bounds &mesh,
                           const piko::Buffer<BvhNode> &nodes,
                           const piko::Buffer<BvhTriangle> &triangles,
                           const Any &any, const Least &least) {
  struct Entry {
    int32_t child, count; // as in a node
    float t;              // where the first ray enters
  };
  constexpr int width = piko::scene::bvhWidth;
  Entry stack[piko::scene::bvhDepth * (width - 1) + 1];
  typename Test::Hit nearest;
  SlabRay slabs(origin, direction, mesh);
  constexpr float nowhere = -1; // the limit of a ray that enters no box
  nearest.t = slabs.isUsable() ? limit : nowhere;
  Test test(origin, direction);

  int top = 0;
  if (nodes.size() > 0)
    stack[top++] = {0, 0, 0};
  while (top > 0) {
    Entry entry = stack[--top];
    if (!any(entry.t <= nearest.t * longer))
      continue;
    for (int i = 0; i < entry.count; ++i)
      if (test.intersect(triangles[entry.child + i], nearest) && anyHit)
        nearest.t = nowhere;
    if (entry.count > 0)
      continue;

    const BvhNode &node = nodes[entry.child];
    // The nearest child comes to the top.
    int bottom = top;
    for (int i = 0; i < width; ++i) {
      float t = slabs.enter(node, i, float(nearest.t) * longer);
      if (!any(t < INFINITY))
        continue;
      float first = least(t);
      int at = top++;
      for (; at > bottom && stack[at - 1].t < first; --at)
        stack[at] = stack[at - 1];
      stack[at] = {node.child[i], node.count[i], first};
    }
  }
  return nearest;
}

} // namespace raytrace

#endif // RAYTRACE_BVH_H
