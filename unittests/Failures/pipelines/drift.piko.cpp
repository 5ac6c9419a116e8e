// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Long sums and many steps in floats. What a sum has lost is kept beside it
// (Neumaier 1974, Dekker 1971), and motion is integrated by a symplectic
// method.
#include <piko.h>

#include "common/lighting.h"

using piko::scene::Light;

//===----------------------------------------------------------------------===//
// Sums
//===----------------------------------------------------------------------===//

struct PlainSum {
  float sum = 0;
  void add(float term) { sum += term; }
  float total() const { return sum; }
};

/// A sum in two floats that do not overlap. They are renormalised at each step:
/// what is lost of millions of terms would otherwise outgrow the last bit of
/// the sum, and lose bits of its own.
struct CompensatedSum {
  float sum = 0, lost = 0;
  void add(float term) {
    float next = sum + term;
    lost += piko::abs(sum) >= piko::abs(term) ? (sum - next) + term
                                              : (term - next) + sum;
    sum = next + lost;
    lost += next - sum;
  }
  float total() const { return sum; }
};

/// A point whose normal is the z axis.
struct Point {
  glm::vec3 position;
  int32_t index;
};
struct LightState {
  piko::Buffer<Light> lights;
  piko::Buffer<float> sums; // one for each Point
};

template <class Sum>
struct SumLights : piko::Stage<0, 0, 64, Point>, piko::Uses<LightState> {
  void process(const Point &p) {
    Sum sum;
    for (int64_t i = 0; i < state().lights.size(); ++i)
      sum.add(raster::irradiance(state().lights[i], p.position, {0, 0, 1}).x);
    state().sums[p.index] = sum.total();
  }
};

struct ReduceLights : piko::Stage<0, 0, 64, Point>, piko::Uses<LightState> {
  void process(const Point &p) {
    state().sums[p.index] = reduce<float>(
        int(state().lights.size()),
        [&](int i) {
          return raster::irradiance(state().lights[i], p.position, {0, 0, 1}).x;
        },
        [](float a, float b) { return a + b; }, 0.0f);
  }
};

template <class Stage> struct LightPipe : piko::Pipe<LightState> {
  Stage light;
  LightPipe() {
    source(light);
    allocateForSource(state().sums, 0);
  }
};
struct PlainLights : LightPipe<SumLights<PlainSum>> {};
struct CompensatedLights : LightPipe<SumLights<CompensatedSum>> {};
struct PairwiseLights : LightPipe<ReduceLights> {};

//===----------------------------------------------------------------------===//
// Steps
//===----------------------------------------------------------------------===//

struct Walk {
  int32_t steps;
  float step;
  int32_t index;
};
/// What a walk has come to: the time, and an integral over it.
struct Arrival {
  float time, depth;
};
struct WalkState {
  piko::Buffer<Arrival> arrivals; // one for each Walk
};

/// How dense a fog is.
inline float densityAt(float t) { return 1 + t * (1 - t); }

struct PlainWalk : piko::Stage<0, 0, 64, Walk>, piko::Uses<WalkState> {
  void process(const Walk &w) {
    float time = 0, depth = 0;
    for (int i = 0; i < w.steps; ++i) {
      depth += densityAt(time + 0.5f * w.step) * w.step;
      time += w.step;
    }
    state().arrivals[w.index] = {time, depth};
  }
};

struct CompensatedWalk : piko::Stage<0, 0, 64, Walk>, piko::Uses<WalkState> {
  void process(const Walk &w) {
    CompensatedSum time, depth;
    for (int i = 0; i < w.steps; ++i) {
      depth.add(densityAt(time.total() + 0.5f * w.step) * w.step);
      time.add(w.step);
    }
    state().arrivals[w.index] = {time.total(), depth.total()};
  }
};

template <class Stage> struct WalkPipe : piko::Pipe<WalkState> {
  Stage walk;
  WalkPipe() {
    source(walk);
    allocateForSource(state().arrivals, 0);
  }
};
struct PlainSteps : WalkPipe<PlainWalk> {};
struct CompensatedSteps : WalkPipe<CompensatedWalk> {};

//===----------------------------------------------------------------------===//
// Particles
//===----------------------------------------------------------------------===//

/// A particle about a mass of 1 at the origin.
struct Particle {
  glm::vec2 position, velocity;
  float step;
  int32_t steps, index;
};
struct ParticleState {
  piko::Buffer<Particle> moved; // one for each Particle
};

inline glm::vec2 accelerationAt(glm::vec2 p) {
  float square = glm::dot(p, p);
  return p * (-1 / (square * piko::sqrt(square)));
}

struct ExplicitEuler {
  static void step(Particle &p) {
    glm::vec2 acceleration = accelerationAt(p.position);
    p.position += p.step * p.velocity;
    p.velocity += p.step * acceleration;
  }
};

/// Half a drift, a kick, half a drift.
struct Leapfrog {
  static void step(Particle &p) {
    p.position += 0.5f * p.step * p.velocity;
    p.velocity += p.step * accelerationAt(p.position);
    p.position += 0.5f * p.step * p.velocity;
  }
};

template <class Method>
struct Move : piko::Stage<0, 0, 64, Particle>, piko::Uses<ParticleState> {
  void process(const Particle &p) {
    Particle moved = p;
    for (int i = 0; i < p.steps; ++i)
      Method::step(moved);
    state().moved[p.index] = moved;
  }
};

template <class Method> struct ParticlePipe : piko::Pipe<ParticleState> {
  Move<Method> move;
  ParticlePipe() {
    source(move);
    allocateForSource(state().moved, 0);
  }
};
struct EulerParticles : ParticlePipe<ExplicitEuler> {};
struct LeapfrogParticles : ParticlePipe<Leapfrog> {};

//===----------------------------------------------------------------------===//
// Rotations
//===----------------------------------------------------------------------===//

/// A point that turns about the origin by turn / 2^32 at each frame.
struct Spinner {
  glm::vec2 position;
  uint32_t turn;
  int32_t frames, index;
};
struct SpinState {
  piko::Buffer<glm::vec2> positions; // one for each Spinner
};

constexpr float turnToRadians = 6.28318531f / 4294967296.0f;

inline glm::vec2 rotate(glm::vec2 p, float angle) {
  float c = piko::cos(angle), s = piko::sin(angle);
  return {c * p.x - s * p.y, s * p.x + c * p.y};
}

// Turns what the last frame had.
struct Rotate : piko::Stage<0, 0, 64, Spinner>, piko::Uses<SpinState> {
  void process(const Spinner &spinner) {
    float angle = float(spinner.turn) * turnToRadians;
    float c = piko::cos(angle), s = piko::sin(angle);
    glm::vec2 p = spinner.position;
    for (int i = 0; i < spinner.frames; ++i)
      p = {c * p.x - s * p.y, s * p.x + c * p.y};
    state().positions[spinner.index] = p;
  }
};

// Has a phase accumulator, which wraps around without an error.
struct Accumulate : piko::Stage<0, 0, 64, Spinner>, piko::Uses<SpinState> {
  void process(const Spinner &spinner) {
    uint32_t phase = 0;
    for (int i = 0; i < spinner.frames; ++i)
      phase += spinner.turn;
    state().positions[spinner.index] =
        rotate(spinner.position, float(int32_t(phase)) * turnToRadians);
  }
};

template <class Method> struct SpinPipe : piko::Pipe<SpinState> {
  Method spin;
  SpinPipe() {
    source(spin);
    allocateForSource(state().positions, 0);
  }
};
struct RotateSpinners : SpinPipe<Rotate> {};
struct PhaseSpinners : SpinPipe<Accumulate> {};
