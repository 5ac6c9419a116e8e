//===- particles.piko.cpp - Particles that glow ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   particles --> Glow (picture)
//
// main.cpp is an application around it whose particles are, and whose picture
// stays, in a GPU's memory.
//
//===----------------------------------------------------------------------===//
#include <piko.h>

#include "particle.h"

namespace particles {

struct State {
  glm::vec3 cold, hot;            // colors
  piko::Image<glm::vec4> picture; // light, and the number of particles
};

struct Glow : piko::Stage<16, 16, 64, Particle>, piko::Uses<State> {
  static constexpr float radius = 3;
  static glm::ivec2 lo(const Particle &p) {
    return {piko::toInt(p.x - radius), piko::toInt(p.y - radius)};
  }
  static glm::ivec2 hi(const Particle &p) {
    return {piko::toInt(p.x + radius) + 1, piko::toInt(p.y + radius) + 1};
  }

  void assignBin(const Particle &p) { assignToBoundingBox(p, lo(p), hi(p)); }

  void process(const Particle &p) {
    glm::vec3 color = glm::mix(state().cold, state().hot, p.heat);
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      glm::vec2 to(float(at.x) + 0.5f - p.x, float(at.y) + 0.5f - p.y);
      float light = 1 - glm::dot(to, to) / (radius * radius);
      if (light > 0)
        update(state().picture, at, [&](glm::vec4 &sum) {
          sum += glm::vec4(color * (light * light), 1);
        });
    });
  }
};

struct Particles : piko::Pipe<State> {
  Glow glow;
  Particles() { source(glow); }
};

} // namespace particles
