//===- Meshes.h - Meshes to trace rays into ---------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_UNITTESTS_RAYTRACE_MESHES_H
#define PIKO_UNITTESTS_RAYTRACE_MESHES_H

#include "Piko/Scene/Bvh.h"

#include <cmath>
#include <random>

using piko::render::Mesh;

inline int addVertex(Mesh &mesh, glm::vec3 position,
                     glm::vec3 normal = {0, 0, 1}) {
  mesh.vertices.push_back({position, normal, int32_t(mesh.vertices.size())});
  return mesh.vertices.back().index;
}

inline void addTriangle(Mesh &mesh, int a, int b, int c) {
  mesh.triangles.push_back({{a, b, c}, int32_t(mesh.triangles.size())});
}

inline void addTriangle(Mesh &mesh, glm::vec3 a, glm::vec3 b, glm::vec3 c) {
  int first = addVertex(mesh, a);
  addVertex(mesh, b);
  addVertex(mesh, c);
  addTriangle(mesh, first, first + 1, first + 2);
}

/// A rectangle of two triangles about `center`.
inline void addRectangle(Mesh &mesh, glm::vec3 center, glm::vec3 right,
                         glm::vec3 up, glm::vec3 normal) {
  int a = addVertex(mesh, center - right - up, normal);
  int b = addVertex(mesh, center + right - up, normal);
  int c = addVertex(mesh, center + right + up, normal);
  int d = addVertex(mesh, center - right + up, normal);
  addTriangle(mesh, a, b, c);
  addTriangle(mesh, a, c, d);
}

/// A cube from -1 to 1 with 2 n^2 triangles a face; a power of two as n gives
/// coordinates without rounding.
inline Mesh makeCube(int n) {
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (float side : {-1.0f, 1.0f})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          glm::vec3 center(0), right(0), up(0);
          center[axis] = side;
          center[(axis + 1) % 3] = (2 * float(i) + 1) / float(n) - 1;
          center[(axis + 2) % 3] = (2 * float(j) + 1) / float(n) - 1;
          right[(axis + 1) % 3] = 1 / float(n);
          up[(axis + 2) % 3] = 1 / float(n);
          addRectangle(mesh, center, right, up, {0, 0, 1});
        }
  return mesh;
}

/// A closed surface like a potato, whose triangles share vertices.
inline Mesh makePotato(int rings, glm::vec3 center) {
  Mesh mesh;
  int around = 2 * rings;
  auto point = [&](int i, int j) {
    float polar = float(M_PI) * float(i) / float(rings);
    float angle = 2 * float(M_PI) * float(j % around) / float(around);
    float radius = 1 + 0.2f * std::sin(3 * polar) * std::cos(5 * angle);
    return center + radius * glm::vec3(std::sin(polar) * std::cos(angle),
                                       std::cos(polar),
                                       std::sin(polar) * std::sin(angle));
  };
  int top = addVertex(mesh, point(0, 0));
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < around; ++j)
      addVertex(mesh, point(i, j));
  int bottom = addVertex(mesh, point(rings, 0));
  auto at = [&](int i, int j) {
    return i == 0       ? top
           : i == rings ? bottom
                        : 1 + (i - 1) * around + j % around;
  };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      if (i > 0)
        addTriangle(mesh, at(i, j), at(i, j + 1), at(i + 1, j));
      if (i + 1 < rings)
        addTriangle(mesh, at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
    }
  return mesh;
}

/// Triangles everywhere between -8 and 8; every third is a needle.
inline Mesh makeSoup(int count, unsigned seed) {
  Mesh mesh;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> d(-1, 1);
  for (int i = 0; i < count; ++i) {
    auto anywhere = [&] {
      glm::vec3 v;
      for (int k = 0; k < 3; ++k)
        v[k] = d(random);
      return v;
    };
    glm::vec3 center = 7.0f * anywhere(), along = anywhere();
    glm::vec3 corner[3];
    for (glm::vec3 &c : corner) {
      c = center + anywhere();
      if (i % 3 == 0)
        c = center + along * d(random) + 1e-5f * anywhere();
    }
    addTriangle(mesh, corner[0], corner[1], corner[2]);
  }
  return mesh;
}

/// Rectangles along two axes each, none of which touches another: their edges
/// are those of boxes.
inline Mesh makeConfetti(int count) {
  Mesh mesh;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> d(-1, 1);
  for (int i = 0; i < count; ++i) {
    glm::vec3 center(0, 0, i), side[3] = {};
    for (int k = 0; k < 3; ++k) {
      center[k] += k < 2 ? 9 * d(random) : 0;
      side[k][k] = 0.4f * (1.1f + d(random));
    }
    addRectangle(mesh, center, side[i % 3], side[(i + 1) % 3], {0, 0, 1});
  }
  return mesh;
}

#endif // PIKO_UNITTESTS_RAYTRACE_MESHES_H
