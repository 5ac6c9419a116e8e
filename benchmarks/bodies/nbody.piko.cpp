// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Gravity between all pairs of a buffer of bodies.
#include <piko.h>

struct Index {
  int i;
};
struct Mass {
  glm::vec3 position;
  float mass;
};
struct State {
  piko::Buffer<Mass> bodies;
  piko::Buffer<glm::vec3> forces;
};

struct Attract : piko::Stage<0, 0, 1, Index>, piko::Uses<State> {
  void process(const Index &index) {
    glm::vec3 at = state().bodies[index.i].position;
    glm::vec3 force(0);
    for (int64_t j = 0; j < state().bodies.size(); ++j) {
      const Mass &other = state().bodies[j];
      glm::vec3 d = other.position - at;
      float r = glm::dot(d, d) + 0.01f;
      float inverse = 1.0f / piko::sqrt(r);
      force += d * (other.mass * inverse * inverse * inverse);
    }
    state().forces[index.i] = force;
  }
};
struct NBody : piko::Pipe<State> {
  Attract attract;
  NBody() { source(attract); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Index> list;
  std::vector<Mass> masses;
  std::vector<glm::vec3> forces;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 1000; ++i) {
      list.push_back({i});
      masses.push_back({{random.in(-1, 1), random.in(-1, 1), random.in(-1, 1)},
                        random.unit()});
    }
    forces.resize(list.size());
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().bodies, masses);
    bodies::bind(pipe.state().forces, forces);
    pipe.feed(pipe.attract, list);
  }
  // Of a pair: 3 differences, a dot product and its offset of 6, a root, a
  // quotient, 3 products for the weight, 3 more and 3 sums.
  double flops() const { return 20.0 * double(masses.size() * masses.size()); }
  // Indices and masses are read, forces are written.
  double bytes() const {
    return double(list.size() * sizeof(Index) + masses.size() * sizeof(Mass) +
                  forces.size() * sizeof(glm::vec3));
  }
  uint64_t result(auto &) { return bodies::hash(forces); }
};
PIKO_BODY_MAIN(NBody, Host)
#endif
