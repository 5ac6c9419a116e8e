//===- voxelize.piko.cpp - A conservative voxelizer in bins of 4 x 4 x 4 --===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   triangles --> Voxelize ---> Mark (voxels)
//
// A voxel is occupied if a triangle touches its closed cube.
//
//===----------------------------------------------------------------------===//
#include <piko.h>

namespace voxelize {

struct Triangle {
  glm::vec3 corner[3]; // in voxels
  int32_t material;
};

struct Fragment {
  glm::ivec3 voxel;
  int32_t material;
};

struct Voxel {
  int32_t triangles = 0;
  int32_t material = -1; // of the last triangle
};

struct State {
  piko::Image<Voxel, 3> voxels;
};

// Whether the projections on an axis, of a triangle relative to the center of a
// cube of side 1 and of the cube, are apart.
inline bool apart(const glm::vec3 (&v)[3], glm::vec3 axis) {
  float a = glm::dot(v[0], axis), b = glm::dot(v[1], axis);
  float c = glm::dot(v[2], axis);
  float radius =
      0.5f * (glm::abs(axis.x) + glm::abs(axis.y) + glm::abs(axis.z));
  return piko::min(piko::min(a, b), c) > radius ||
         piko::max(piko::max(a, b), c) < -radius;
}

// The separating axis test.
inline bool touches(const Triangle &t, glm::ivec3 voxel) {
  glm::vec3 center = glm::vec3(voxel) + 0.5f;
  glm::vec3 v[3];
  for (int i = 0; i < 3; ++i)
    v[i] = t.corner[i] - center;
  for (int i = 0; i < 3; ++i) {
    glm::vec3 unit(0);
    unit[i] = 1;
    if (apart(v, unit))
      return false;
    for (int j = 0; j < 3; ++j)
      if (apart(v, glm::cross(unit, v[(j + 1) % 3] - v[j])))
        return false;
  }
  return !apart(v, glm::cross(v[1] - v[0], v[2] - v[0]));
}

struct Voxelize
    : piko::BasicStage<piko::Bins<4, 4, 4>, 64, Triangle, Fragment> {
  void assignBin(const Triangle &t) {
    assignToBoundingBox(
        t, glm::min(glm::min(t.corner[0], t.corner[1]), t.corner[2]),
        glm::max(glm::max(t.corner[0], t.corner[1]), t.corner[2]));
  }

  void process(const Triangle &t) {
    parallelForPixels([&](glm::ivec3 voxel) {
      if (touches(t, voxel))
        emit({voxel, t.material});
    });
  }
};

struct Mark : piko::BasicStage<piko::Bins<4, 4, 4>, 64, Fragment>,
              piko::Uses<State> {
  void assignBin(const Fragment &f) { assignToPreviousBins(f); }

  void process(const Fragment &f) {
    update(state().voxels, f.voxel, [&](Voxel &voxel) {
      voxel.triangles += 1;
      voxel.material = f.material;
    });
  }
};

struct Voxelizer : piko::Pipe<State> {
  Voxelize voxelize;
  Mark mark;

  Voxelizer() {
    source(voxelize);
    connect(voxelize, 0, mark);
  }
};

} // namespace voxelize
