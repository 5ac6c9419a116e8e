//===- DepthRange.cpp - What a camera's near and far planes cut -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "DepthRange.h"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

using namespace piko;
using namespace piko::render;

namespace {

/// A point in a camera's axes: x and y in halves of the image at distance 1,
/// and the distance. What is seen has |x| <= z and |y| <= z.
using EyePoint = glm::dvec3;

class EyeSpace {
public:
  explicit EyeSpace(const scene::Camera &camera)
      : eye(camera.eye), x(camera.right), y(camera.up), z(camera.forward) {
    x /= glm::dot(x, x);
    y /= glm::dot(y, y);
  }
  EyePoint operator()(glm::vec3 p) const {
    glm::dvec3 d = glm::dvec3(p) - eye;
    return {glm::dot(x, d), glm::dot(y, d), glm::dot(z, d)};
  }

private:
  glm::dvec3 eye, x, y, z;
};

/// How far inside of a side of the view a point is; negative outside.
double insideOf(int side, EyePoint p) {
  double across = side < 2 ? p.x : p.y;
  return p.z + (side % 2 == 0 ? across : -across);
}

bool areOutside(std::span<const EyePoint> points) {
  for (int side = 0; side < 4; ++side)
    if (std::ranges::all_of(points,
                            [&](EyePoint p) { return insideOf(side, p) < 0; }))
      return true;
  return false;
}

/// Distances of what is seen; empty at first.
struct SeenRange {
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0;

  void add(std::span<const EyePoint> points) {
    for (EyePoint p : points) {
      nearest = std::min(nearest, std::max(p.z, 0.0));
      farthest = std::max(farthest, p.z);
    }
  }
  bool isBetweenPlanesOf(const scene::Camera &camera) const {
    return nearest >= camera.nearZ && farthest <= camera.farZ;
  }
};

/// Clips a triangle at the sides of the view (Sutherland and Hodgman 1974).
SeenRange clippedRange(const std::array<EyePoint, 3> &triangle) {
  std::array<EyePoint, 7> polygon, kept;
  std::ranges::copy(triangle, polygon.begin());
  size_t count = 3;
  for (int side = 0; side < 4; ++side) {
    size_t keptCount = 0;
    auto keep = [&](EyePoint p) {
      if (keptCount < kept.size())
        kept[keptCount++] = p;
    };
    for (size_t i = 0; i < count; ++i) {
      EyePoint a = polygon[i], b = polygon[(i + 1) % count];
      double da = insideOf(side, a), db = insideOf(side, b);
      if (da >= 0)
        keep(a);
      if ((da >= 0) != (db >= 0))
        keep(a + (b - a) * (da / (da - db)));
    }
    polygon = kept;
    count = keptCount;
  }
  SeenRange range;
  range.add(std::span(polygon).first(count));
  return range;
}

/// The control points of a patch or a part of it.
struct EyeHull {
  std::array<EyePoint, 16> points;

  /// By de Casteljau.
  std::pair<EyeHull, EyeHull> halved(bool alongU) const {
    size_t along = alongU ? 4 : 1, across = alongU ? 1 : 4;
    std::pair<EyeHull, EyeHull> halves;
    for (size_t j = 0; j < 4; ++j) {
      auto at = [&](size_t i) { return along * i + across * j; };
      EyePoint a = points[at(0)], b = points[at(1)], c = points[at(2)],
               d = points[at(3)];
      EyePoint ab = (a + b) * 0.5, bc = (b + c) * 0.5, cd = (c + d) * 0.5;
      EyePoint abc = (ab + bc) * 0.5, bcd = (bc + cd) * 0.5;
      EyePoint middle = (abc + bcd) * 0.5;
      EyePoint first[] = {a, ab, abc, middle}, second[] = {middle, bcd, cd, d};
      for (size_t i = 0; i < 4; ++i) {
        halves.first.points[at(i)] = first[i];
        halves.second.points[at(i)] = second[i];
      }
    }
    return halves;
  }
};

/// Halves what is seen on both sides of a plane.
void addSeen(const scene::Camera &camera, const EyeHull &hull, int halvings,
             SeenRange &range) {
  constexpr int mostHalvings = 16;
  if (areOutside(hull.points))
    return;
  SeenRange own;
  own.add(hull.points);
  bool isInRange =
      own.nearest >= range.nearest && own.farthest <= range.farthest;
  if (own.isBetweenPlanesOf(camera) || isInRange || halvings == mostHalvings)
    return range.add(hull.points);
  auto [first, second] = hull.halved(halvings % 2 == 0);
  addSeen(camera, first, halvings + 1, range);
  addSeen(camera, second, halvings + 1, range);
}

void addTo(CutParts &parts, const scene::Camera &camera,
           const SeenRange &range) {
  if (range.nearest < camera.nearZ) {
    ++parts.beforeNear;
    parts.nearest = std::min(parts.nearest, range.nearest);
  }
  if (range.farthest > camera.farZ) {
    ++parts.beyondFar;
    parts.farthest = std::max(parts.farthest, range.farthest);
  }
}

} // namespace

CutParts render::findCutParts(const scene::Camera &camera, const Mesh &mesh) {
  EyeSpace toEye(camera);
  std::vector<EyePoint> points;
  points.reserve(mesh.vertices.size());
  for (const scene::Vertex &v : mesh.vertices)
    points.push_back(toEye(v.position));
  CutParts parts;
  for (const scene::Triangle &t : mesh.triangles) {
    std::array corners = {points[size_t(t.vertex.x)],
                          points[size_t(t.vertex.y)],
                          points[size_t(t.vertex.z)]};
    SeenRange whole;
    whole.add(corners);
    bool isEdgeOn =
        glm::dot(glm::cross(corners[0], corners[1]), corners[2]) == 0;
    if (!whole.isBetweenPlanesOf(camera) && !isEdgeOn && !areOutside(corners))
      addTo(parts, camera, clippedRange(corners));
  }
  for (const scene::Patch &patch : mesh.patches) {
    EyeHull hull;
    std::ranges::transform(patch.points, hull.points.begin(), toEye);
    SeenRange range;
    addSeen(camera, hull, 0, range);
    addTo(parts, camera, range);
  }
  return parts;
}
