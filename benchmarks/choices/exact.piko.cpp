//===- exact.piko.cpp - The picture that choices are measured against -----===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Rays in double, `samples` by `samples` of them on a regular grid in each
// pixel, through a tree of boxes that are wider than what float rounds. There
// is no depth buffer, no grid of corners and no map that could be coarser or
// finer.
//
//===----------------------------------------------------------------------===//
#include <piko.h>
#include <piko/scene.h>

#include "raytrace/bvh.h"

using namespace piko::scene;

namespace exact {

struct State {
  Camera camera;
  Settings settings;
  int32_t samples = 1; ///< in a row and in a column of a pixel
  int32_t shadows = 0; ///< whether the first far light casts shadows
  Bounds bounds;
  piko::Buffer<BvhNode> nodes;
  piko::Buffer<BvhTriangle> leaves;
  piko::Buffer<Triangle> triangles;
  piko::Buffer<Vertex> vertices;
  piko::Buffer<Light> lights;
  piko::Image<Color> image;
};

struct Hit {
  double t;
  int32_t triangle = -1;
  glm::dvec3 weight;
};

/// Moeller and Trumbore (1997); a ray through an edge meets both triangles, of
/// which that of the smaller index counts.
inline void intersect(glm::dvec3 origin, glm::dvec3 direction,
                      const BvhTriangle &triangle, Hit &nearest) {
  auto corner = [&](int i) {
    return glm::dvec3(triangle.corner[i][0], triangle.corner[i][1],
                      triangle.corner[i][2]);
  };
  glm::dvec3 a = corner(0), ab = corner(1) - a, ac = corner(2) - a;
  glm::dvec3 p = glm::cross(direction, ac);
  double det = glm::dot(ab, p);
  if (det == 0)
    return;
  glm::dvec3 from = origin - a;
  glm::dvec3 q = glm::cross(from, ab);
  double v = glm::dot(from, p) / det, w = glm::dot(direction, q) / det;
  double t = glm::dot(ac, q) / det;
  bool isHit = v >= 0 && w >= 0 && v + w <= 1 && t > 0;
  if (!isHit || t > nearest.t ||
      (t == nearest.t && nearest.triangle < triangle.index))
    return;
  nearest = {t, triangle.index, {1 - v - w, v, w}};
}

struct Render : piko::Stage<16, 16, 64, Nothing>, piko::Uses<State> {
  void assignBin(const Nothing &n) { assignToAll(n); }
  void schedule(piko::BinId) { everyBin(); }

  void process(const piko::List<Nothing> &) {
    parallelForPixels([&](glm::ivec2 pixel) {
      int n = state().samples;
      glm::dvec4 sum(0);
      for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x)
          sum +=
              colorAt(glm::dvec2(pixel) + (glm::dvec2(x, y) + 0.5) / double(n));
      update(state().image, pixel,
             [&](Color &c) { c.rgba = glm::vec4(sum / double(n * n)); });
    });
  }

private:
  Hit find(glm::dvec3 origin, glm::dvec3 direction, double limit) {
    struct Entry {
      int32_t child, count;
    };
    Entry stack[bvhDepth * (bvhWidth - 1) + 1];
    Hit nearest{limit, -1, {}};
    raytrace::SlabRay slabs{glm::vec3(origin), glm::vec3(direction),
                            state().bounds};
    int top = 0;
    if (state().nodes.size() > 0)
      stack[top++] = {0, 0};
    while (top > 0) {
      Entry entry = stack[--top];
      for (int i = 0; i < entry.count; ++i)
        intersect(origin, direction, state().leaves[entry.child + i], nearest);
      if (entry.count > 0)
        continue;
      const BvhNode &node = state().nodes[entry.child];
      float reach = float(nearest.t) * raytrace::longer;
      for (int i = 0; i < bvhWidth; ++i)
        if (slabs.enter(node, i, reach) < INFINITY)
          stack[top++] = {node.child[i], node.count[i]};
    }
    return nearest;
  }

  glm::dvec4 colorAt(glm::dvec2 at) {
    const Camera &c = state().camera;
    glm::dvec2 size = domain();
    glm::dvec3 eye = c.eye;
    glm::dvec3 ray = glm::dvec3(c.forward) +
                     glm::dvec3(c.right) * (2 * at.x / size.x - 1) +
                     glm::dvec3(c.up) * (1 - 2 * at.y / size.y);
    Hit hit = find(eye, ray, INFINITY);
    if (hit.triangle < 0)
      return glm::dvec4(Color().rgba);
    const Triangle &t = state().triangles[hit.triangle];
    glm::dvec3 normal(0);
    for (int i = 0; i < 3; ++i)
      normal +=
          glm::dvec3(state().vertices[t.vertex[i]].normal) * hit.weight[i];
    normal = glm::normalize(normal);
    return glm::dvec4(shade(eye + ray * hit.t, normal, facetOf(t), ray), 1);
  }

  glm::dvec3 facetOf(const Triangle &t) {
    glm::dvec3 a = state().vertices[t.vertex.x].position;
    return glm::cross(glm::dvec3(state().vertices[t.vertex.y].position) - a,
                      glm::dvec3(state().vertices[t.vertex.z].position) - a);
  }

  glm::dvec3 shade(glm::dvec3 position, glm::dvec3 normal, glm::dvec3 facet,
                   glm::dvec3 ray) {
    glm::dvec3 sum(state().settings.ambient);
    bool isFirst = state().shadows != 0;
    for (int64_t i = 0; i < state().lights.size(); ++i) {
      const Light &light = state().lights[i];
      double w = light.position.w;
      glm::dvec3 l = glm::dvec3(light.position) - w * position;
      double facing = glm::dot(normal, l) / glm::sqrt(glm::dot(l, l));
      if (facing > 0 && w == 0 && isFirst) {
        isFirst = false;
        // Beside the triangle, on the side that is seen.
        double side = glm::dot(facet, ray) > 0 ? -1.0 : 1.0;
        double step = 1e-9 * glm::length(position) / glm::length(facet);
        if (find(position + facet * (side * step), l, INFINITY).triangle >= 0)
          continue;
      }
      if (facing > 0)
        sum += glm::dvec3(light.color) * facing;
    }
    return double(state().settings.albedo) * sum;
  }
};

struct Exact : piko::Pipe<State> {
  Render render;
  Exact() { source(render); }
};

} // namespace exact
