// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What rays meet first. `MollerTrumboreRays` decides for each triangle on its
// own, in floats; the example's test is watertight.
#include "raytrace/triangle.h"

using piko::scene::BvhTriangle;
using raytrace::Hit;

struct Query {
  glm::vec3 origin, direction;
  int32_t index;
};
struct Answer {
  float t;
  int32_t triangle; // -1 if there is none
};
struct State {
  piko::Buffer<BvhTriangle> triangles;
  piko::Buffer<Answer> answers; // one for each Query
};

template <class Test>
struct Find : piko::Stage<0, 0, 64, Query>, piko::Uses<State> {
  void process(const Query &q) {
    Test test(q.origin, q.direction);
    Hit nearest;
    nearest.t = INFINITY;
    for (int64_t i = 0; i < state().triangles.size(); ++i)
      test.intersect(state().triangles[i], nearest);
    state().answers[q.index] = {nearest.t, nearest.triangle};
  }
};

// Moller and Trumbore 1997.
struct MollerTrumbore {
  static constexpr float epsilon = 1e-7f;
  glm::vec3 origin, direction;

  MollerTrumbore(glm::vec3 origin, glm::vec3 direction)
      : origin(origin), direction(direction) {}

  static glm::vec3 toVec(const float (&v)[3]) { return {v[0], v[1], v[2]}; }

  bool intersect(const BvhTriangle &triangle, Hit &nearest) const {
    glm::vec3 a = toVec(triangle.corner[0]);
    glm::vec3 side1 = toVec(triangle.corner[1]) - a;
    glm::vec3 side2 = toVec(triangle.corner[2]) - a;
    glm::vec3 across = glm::cross(direction, side2);
    float determinant = glm::dot(side1, across);
    if (glm::abs(determinant) < epsilon)
      return false;
    float inverse = 1 / determinant;
    glm::vec3 from = origin - a;
    float u = inverse * glm::dot(from, across);
    if (u < 0 || u > 1)
      return false;
    glm::vec3 along = glm::cross(from, side1);
    float v = inverse * glm::dot(direction, along);
    if (v < 0 || u + v > 1)
      return false;
    float t = inverse * glm::dot(side2, along);
    if (!(t > 0 && t < nearest.t))
      return false;
    nearest.t = t;
    nearest.triangle = triangle.index;
    return true;
  }
};

template <class Test> struct Rays : piko::Pipe<State> {
  Find<Test> find;
  Rays() {
    source(find);
    allocateForSource(state().answers, 0);
  }
};
struct MollerTrumboreRays : Rays<MollerTrumbore> {};
struct WatertightRays : Rays<raytrace::ShearedRay> {};
