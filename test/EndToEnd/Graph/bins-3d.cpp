// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bins of rank 3 over a volume whose edge bins are partial.
// RUN: %compare_targets %s --domain 33 18 7 --count 3000 | FileCheck %s
// CHECK: equal
#include <piko.h>

struct Particle {
  glm::vec3 position;
  float mass;
};
struct Voxel {
  float density = 0.25f;
  int count = 0;
};
struct State {
  piko::Image<Voxel, 3> volume;
};

struct Splat : piko::BasicStage<piko::Bins<8, 8, 4>, 64, Particle>,
               piko::Uses<State> {
  void assignBin(const Particle &p) {
    assignToBoundingBox(p, p.position - 1.5f, p.position + 1.5f);
  }
  void process(const Particle &p) {
    glm::ivec3 lo = binLo(), hi = binHi();
    glm::ivec3 from = glm::max(glm::ivec3(glm::floor(p.position - 1.5f)), lo);
    glm::ivec3 to = glm::min(glm::ivec3(glm::floor(p.position + 1.5f)) + 1, hi);
    for (int z = from.z; z < to.z; ++z)
      for (int y = from.y; y < to.y; ++y)
        for (int x = from.x; x < to.x; ++x) {
          glm::vec3 offset = glm::vec3(x, y, z) - p.position;
          float weight = 1 / (1 + glm::dot(offset, offset));
          update(state().volume, glm::ivec3(x, y, z), [&](Voxel &v) {
            v.density = v.density * 0.9f + weight * p.mass;
            v.count += 1;
          });
        }
  }
};
struct Volume : piko::Pipe<State> {
  Splat splat;
  Volume() { source(splat); }
};
