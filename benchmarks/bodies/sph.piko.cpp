// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Smoothed particles: density and force from the particles of a bin in space,
// each with all others in the list.
#include <piko.h>

struct Particle {
  glm::vec3 position, velocity;
  float mass;
  int index;
};
struct Result {
  glm::vec3 force;
  float density;
};
struct State {
  float radius = 1;
  piko::Buffer<Result> results;
};

struct Interact : piko::BasicStage<piko::Bins<2, 2, 2>, 1, Particle>,
                  piko::Uses<State> {
  void assignBin(const Particle &p) {
    assignToBoundingBox(p, p.position - state().radius,
                        p.position + state().radius);
  }
  void process(const piko::List<Particle> &list) {
    float h = state().radius;
    for (const Particle &a : list) {
      if (binFromPosition(a.position) != bin())
        continue;
      Result result{glm::vec3(0), 0};
      for (const Particle &b : list) {
        glm::vec3 d = b.position - a.position;
        float r2 = glm::dot(d, d);
        if (r2 >= h * h)
          continue;
        float w = h * h - r2;
        result.density += b.mass * w * w * w;
        if (a.index != b.index) {
          float r = piko::sqrt(r2) + 0.001f;
          result.force += d * (b.mass * (h - r) * (h - r) / r);
          result.force += (b.velocity - a.velocity) * (b.mass * (h - r));
        }
      }
      state().results[a.index] = result;
    }
  }
};
struct Smoothed : piko::Pipe<State> {
  Interact interact;
  Smoothed() { source(interact); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Particle> particles;
  std::vector<Result> results;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 8000; ++i)
      particles.push_back(
          {{random.in(0, 16), random.in(0, 16), random.in(0, 16)},
           {random.in(-1, 1), random.in(-1, 1), random.in(-1, 1)},
           random.in(0.5f, 1),
           i});
    results.resize(particles.size());
    pipe.setDomain({16, 16, 16});
    pipe.state().radius = 1.0f;
    bodies::bind(pipe.state().results, results);
    pipe.feed(pipe.interact, particles);
  }
  uint64_t result(auto &) { return bodies::hash(results); }
};
PIKO_BODY_MAIN(Smoothed, Host)
#endif
