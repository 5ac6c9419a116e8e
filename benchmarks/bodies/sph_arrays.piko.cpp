// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Smoothed particles, as records of 252 bytes that are sorted into bins first
// and then searched through a buffer of starts, nine rows of cells each.
#include <piko.h>

struct Particle {
  glm::vec3 position, velocity, force;
  float density, pressure, history[50];
  int cell, index;
};
static_assert(sizeof(Particle) == 252);
struct State {
  int cells = 0;                    // along each axis
  piko::Buffer<Particle> particles; // by cell
  piko::Buffer<int> starts;
  piko::Buffer<float> densities;
};

struct Density : piko::Stage<0, 0, 1, Particle, Particle>, piko::Uses<State> {
  void process(const Particle &p) {
    int n = state().cells;
    glm::ivec3 at(p.position);
    float density = 0;
    for (int z = glm::max(at.z - 1, 0); z <= glm::min(at.z + 1, n - 1); ++z)
      for (int y = glm::max(at.y - 1, 0); y <= glm::min(at.y + 1, n - 1); ++y)
        for (int x = glm::max(at.x - 1, 0); x <= glm::min(at.x + 1, n - 1);
             ++x) {
          int cell = (z * n + y) * n + x;
          for (int i = state().starts[cell]; i < state().starts[cell + 1];
               ++i) {
            glm::vec3 d = state().particles[i].position - p.position;
            float w = 1 - glm::dot(d, d);
            if (w > 0)
              density += w * w * w;
          }
        }
    Particle next = p;
    next.density = density;
    next.pressure = glm::max(density - 1, 0.0f);
    emit(next);
  }
};
struct Keep : piko::Stage<0, 0, 1, Particle>, piko::Uses<State> {
  void process(const Particle &p) {
    state().densities[p.index] =
        p.density * p.pressure + p.history[p.index % 50];
  }
};
struct SphArrays : piko::Pipe<State> {
  Density density;
  Keep keep;
  SphArrays() {
    source(density);
    connect(density, 0, keep);
  }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int n = 12;
  std::vector<Particle> particles;
  std::vector<int> starts;
  std::vector<float> densities;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 8000; ++i) {
      Particle p = {};
      float size = float(n);
      p.position = {random.in(0, size), random.in(0, size), random.in(0, size)};
      p.cell =
          (int(p.position.z) * n + int(p.position.y)) * n + int(p.position.x);
      particles.push_back(p);
    }
    std::stable_sort(
        particles.begin(), particles.end(),
        [](const Particle &a, const Particle &b) { return a.cell < b.cell; });
    starts.assign(n * n * n + 1, 0);
    for (size_t i = 0; i < particles.size(); ++i) {
      particles[i].index = int(i);
      ++starts[particles[i].cell + 1];
    }
    for (int i = 0; i < n * n * n; ++i)
      starts[i + 1] += starts[i];
    densities.resize(particles.size());
    pipe.setDomain({1, 1});
    pipe.state().cells = n;
    bodies::bind(pipe.state().particles, particles);
    bodies::bind(pipe.state().starts, starts);
    bodies::bind(pipe.state().densities, densities);
    pipe.feed(pipe.density, particles);
  }
  uint64_t result(auto &) { return bodies::hash(densities); }
};
PIKO_BODY_MAIN(SphArrays, Host)
#endif
