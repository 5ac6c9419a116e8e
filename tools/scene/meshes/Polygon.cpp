//===- Polygon.cpp - Splits polygons into triangles -----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A polygon is looked at along the axis that its normal is nearest to, so that
// two coordinates of its corners are left as they are.
//
//===----------------------------------------------------------------------===//
#include "MeshBuilder.h"

#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

using namespace piko;
using namespace piko::render;

namespace {

/// Steps that all polygons of a file may take: some seconds.
constexpr uint64_t stepLimit = 2'000'000'000;

/// Twice the area of a triangle: above 0 if it turns left.
double turn(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// The corners in the plane of the polygon, where it turns left; empty if it
/// has no area.
std::vector<glm::dvec2> flatten(std::span<const glm::vec3> corners) {
  glm::dvec3 normal(0), first(corners[0]);
  for (size_t i = 1; i + 1 < corners.size(); ++i)
    normal += glm::cross(glm::dvec3(corners[i]) - first,
                         glm::dvec3(corners[i + 1]) - first);
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(normal[k]) > std::abs(normal[axis]))
      axis = k;
  std::vector<glm::dvec2> flat;
  if (!(std::abs(normal[axis]) > 0))
    return flat;
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0)
    std::swap(u, v);
  for (glm::vec3 corner : corners)
    flat.emplace_back(corner[u], corner[v]);
  return flat;
}

bool isConvex(const std::vector<glm::dvec2> &flat) {
  size_t n = flat.size();
  for (size_t i = 0; i < n; ++i)
    if (turn(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) <= 0)
      return false;
  // One that winds twice turns left everywhere, too.
  for (size_t i = 1; i + 1 < n; ++i)
    if (turn(flat[0], flat[i], flat[i + 1]) <= 0)
      return false;
  return true;
}

/// Cuts a polygon's ears: corners whose triangle holds no other corner.
class EarCutter {
public:
  EarCutter(const std::vector<glm::dvec2> &flat,
            std::vector<glm::ivec3> &triangles, uint64_t &steps)
      : flat(flat), triangles(triangles), steps(steps), left(flat.size()) {
    for (size_t i = 0; i < left; ++i) {
      before.push_back(int(i == 0 ? left - 1 : i - 1));
      after.push_back(int(i + 1 == left ? 0 : i + 1));
    }
  }

  bool run() {
    int corner = 0;
    // How far what a triangle may hold was relaxed: polygons that touch
    // themselves have only ears with corners on their edges, those that cross
    // themselves may have none.
    int relaxed = 0;
    for (size_t sinceLast = 0; left > 3;) {
      if (steps > stepLimit)
        return false;
      if (isEar(corner, relaxed)) {
        int next = after[corner];
        cut(corner);
        corner = next;
        sinceLast = 0;
        relaxed = 0;
        continue;
      }
      corner = after[corner];
      if (++sinceLast == left) {
        sinceLast = 0;
        ++relaxed;
      }
    }
    cut(corner);
    return true;
  }

private:
  double turnAt(int i) const {
    return turn(flat[before[i]], flat[i], flat[after[i]]);
  }

  bool isEar(int i, int relaxed) {
    ++steps;
    if (relaxed > 2)
      return true;
    double area = turnAt(i);
    // Corners on a line, or twice at a place, go last: they are needed for
    // the triangles of their neighbours.
    if (relaxed == 2)
      return area >= 0;
    if (!(area > 0))
      return false;
    for (int p = after[after[i]]; p != before[i]; p = after[p]) {
      ++steps;
      if (turnAt(p) <= 0 && holds(i, flat[p], relaxed == 1))
        return false;
    }
    return true;
  }

  /// Whether the triangle at a corner holds a point; points on its edges only
  /// if it is not to be `strictly` inside.
  bool holds(int i, glm::dvec2 p, bool strictly) const {
    glm::dvec2 a = flat[before[i]], b = flat[i], c = flat[after[i]];
    if (p == a || p == b || p == c)
      return false;
    double least =
        std::min(std::min(turn(a, b, p), turn(b, c, p)), turn(c, a, p));
    return strictly ? least > 0 : least >= 0;
  }

  void cut(int i) {
    if (turnAt(i) != 0)
      triangles.emplace_back(before[i], i, after[i]);
    after[before[i]] = after[i];
    before[after[i]] = before[i];
    --left;
  }

  const std::vector<glm::dvec2> &flat;
  std::vector<glm::ivec3> &triangles;
  uint64_t &steps;
  size_t left;
  std::vector<int> before, after;
};

/// The corner of a quadrilateral that its diagonal has to start at: one of
/// more than 180 degrees, if there is.
int findDiagonal(std::span<const glm::vec3> corners) {
  auto direction = [&](int from, int to) {
    return normalizeOr(corners[to] - corners[from], glm::vec3(0));
  };
  for (int i = 0; i < 4; ++i) {
    glm::vec3 across = direction(i, (i + 2) % 4);
    // The cosines of two angles that together are more than 180 degrees.
    float sum = glm::dot(direction(i, (i + 3) % 4), across) +
                glm::dot(direction(i, (i + 1) % 4), across);
    if (sum < -1e-6f)
      return i;
  }
  return 0;
}

} // namespace

bool render::splitPolygon(std::span<const glm::vec3> corners,
                          std::vector<glm::ivec3> &triangles, uint64_t &steps) {
  int n = int(corners.size());
  if (n == 4) {
    int s = findDiagonal(corners);
    triangles.emplace_back(s, (s + 1) % 4, (s + 2) % 4);
    triangles.emplace_back(s, (s + 2) % 4, (s + 3) % 4);
    return true;
  }
  std::vector<glm::dvec2> flat = flatten(corners);
  if (!flat.empty() && !isConvex(flat))
    return EarCutter(flat, triangles, steps).run();
  for (int i = 1; i + 1 < n; ++i)
    triangles.emplace_back(0, i, i + 1);
  return true;
}
