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
    for (int i = 0; i < 3; ++i) {
      nearScale[i] = 1 / direction[i]; // of 0 it is infinite
      farScale[i] = nearScale[i] * longer;
      bool isForward = nearScale[i] > 0;
      // These sums are rounded, too.
      float wide = margin + 4 * epsilon * glm::abs(origin[i]);
      nearOrigin[i] = isForward ? origin[i] + wide : origin[i] - wide;
      farOrigin[i] = isForward ? origin[i] - wide : origin[i] + wide;
      nearSide[i] = isForward ? i : i + 3;
      farSide[i] = isForward ? i + 3 : i;
    }
    float length2 = glm::dot(direction, direction);
    usable = length2 > 1e-36f && length2 < 1e36f && margin < 1e12f;
  }

  /// False if numbers are out of range or NaN.
  bool isUsable() const { return usable; }

  /// Where the ray enters child i of a node, between 0 and limit; -1 if it does
  /// not.
  float enter(const BvhNode &node, int i, float limit) const {
    float in = 0, out = limit;
    for (int k = 0; k < 3; ++k) {
      float n = (node.bounds[nearSide[k]][i] - nearOrigin[k]) * nearScale[k];
      float f = (node.bounds[farSide[k]][i] - farOrigin[k]) * farScale[k];
      // NaN, which is 0 times infinity in a plane of the box, changes nothing.
      in = in < n ? n : in;
      out = f < out ? f : out;
    }
    return in <= out ? in : -1.0f;
  }

private:
  glm::vec3 nearOrigin, farOrigin, nearScale, farScale;
  int nearSide[3], farSide[3];
  bool usable;
};

/// The nearest hit with 0 < t < limit; of equally near ones that of the
/// smallest index. If `AnyHit`, one of the hits. None if the direction is
/// shorter than 1e-18 or longer than 1e18, or the mesh is farther away.
template <bool AnyHit>
Hit findHit(glm::vec3 origin, glm::vec3 direction, float limit,
            const piko::scene::Bounds &mesh, const piko::Buffer<BvhNode> &nodes,
            const piko::Buffer<BvhTriangle> &triangles) {
  struct Entry {
    int32_t child, count; // as in a node
    float t;              // where the ray enters
  };
  constexpr int width = piko::scene::bvhWidth;
  Entry stack[piko::scene::bvhDepth * (width - 1) + 1];
  Hit nearest;
  nearest.t = limit;
  SlabRay slabs(origin, direction, mesh);
  if (nodes.size() == 0 || !slabs.isUsable())
    return nearest;
  ShearedRay sheared(origin, direction);

  int top = 0;
  stack[top++] = {0, 0, 0};
  while (top > 0) {
    Entry entry = stack[--top];
    if (entry.t > nearest.t * longer)
      continue;
    for (int i = 0; i < entry.count; ++i)
      if (sheared.intersect(triangles[entry.child + i], nearest) && AnyHit)
        return nearest;
    if (entry.count > 0)
      continue;

    const BvhNode &node = nodes[entry.child];
    float enter[width];
    for (int i = 0; i < width; ++i)
      enter[i] = slabs.enter(node, i, nearest.t * longer);
    int hit[width], hits = 0;
    for (int i = 0; i < width; ++i) {
      hit[hits] = i;
      hits += enter[i] >= 0;
    }
    // The nearest child comes to the top.
    int bottom = top;
    for (int k = 0; k < hits; ++k) {
      int i = hit[k], at = top++;
      for (; at > bottom && stack[at - 1].t < enter[i]; --at)
        stack[at] = stack[at - 1];
      stack[at] = {node.child[i], node.count[i], enter[i]};
    }
  }
  return nearest;
}

} // namespace raytrace

#endif // RAYTRACE_BVH_H
