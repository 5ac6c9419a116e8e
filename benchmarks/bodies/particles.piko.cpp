// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Particles with their state in buffers: forces, bounces, an age.
#include <piko.h>

struct Index {
  int i;
};
struct Motion {
  glm::vec3 position, velocity;
};
struct State {
  float dt = 0.01f;
  glm::vec3 wind{0};
  piko::Buffer<Motion> motions;
  piko::Buffer<float> ages;
  piko::Buffer<int> bounces;
};

struct Step : piko::Stage<0, 0, 1, Index>, piko::Uses<State> {
  void process(const Index &index) {
    Motion &m = state().motions[index.i];
    glm::vec3 drag = state().wind - m.velocity;
    m.velocity += state().dt * (glm::vec3(0, -9.81f, 0) + 0.1f * drag);
    m.position += state().dt * m.velocity;
    for (int d = 0; d < 3; ++d)
      if (m.position[d] < 0 || m.position[d] > 10) {
        m.position[d] = glm::clamp(m.position[d], 0.0f, 10.0f);
        m.velocity[d] *= -0.8f;
        state().bounces[index.i] += 1;
      }
    state().ages[index.i] += state().dt;
  }
};
struct Particles : piko::Pipe<State> {
  Step step;
  Particles() { source(step); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Index> list;
  std::vector<Motion> motions;
  std::vector<float> ages;
  std::vector<int> bounces;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 50000; ++i) {
      list.push_back({i});
      motions.push_back(
          {{random.in(0, 10), random.in(0, 10), random.in(0, 10)},
           {random.in(-5, 5), random.in(-5, 5), random.in(-5, 5)}});
    }
    ages.resize(list.size());
    bounces.resize(list.size());
    pipe.setDomain({1, 1});
    pipe.state().dt = 0.01f;
    pipe.state().wind = glm::vec3(1, 0, 0.5f);
    bodies::bind(pipe.state().motions, motions);
    bodies::bind(pipe.state().ages, ages);
    bodies::bind(pipe.state().bounces, bounces);
    pipe.feed(pipe.step, list);
  }
  uint64_t result(auto &) {
    return bodies::hash(motions) ^ bodies::hash(ages) ^ bodies::hash(bounces);
  }
};
PIKO_BODY_MAIN(Particles, Host)
#endif
