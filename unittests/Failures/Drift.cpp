//===- Drift.cpp - Errors that many steps add up --------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Cast.h"
#include "Failure.h"

#include "common/lighting.h"

#include "CompensatedLights.h"
#include "CompensatedSteps.h"
#include "EulerParticles.h"
#include "LeapfrogParticles.h"
#include "PairwiseLights.h"
#include "PhaseSpinners.h"
#include "PlainLights.h"
#include "PlainSteps.h"
#include "RotateSpinners.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace failures {
namespace {

//===----------------------------------------------------------------------===//
// Sums
//===----------------------------------------------------------------------===//

struct Lighting {
  static constexpr float sun = 64;
  std::vector<piko::scene::Light> lights;
  std::vector<glm::vec3> points;

  /// The sun, and so many faint lights above points of a square.
  Lighting(int count, int side) {
    std::mt19937 random(9);
    auto below = [&](int n) { return float(random() % n) / n; };
    lights.push_back({{0, 0, 1, 0}, {sun, sun, sun, 0}});
    for (int i = 0; i < count; ++i) {
      float x = 8 * below(4096) - 4, y = 8 * below(4096) - 4;
      float z = 1 + below(1024), power = 2.0f / count;
      lights.push_back({{x, y, z, 1}, {power, power, power, 0}});
    }
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x)
        points.emplace_back(8.0f * x / side - 4, 8.0f * y / side - 4, 0);
  }

  double exactAt(glm::vec3 point) const {
    double sum = 0;
    for (const auto &light : lights)
      sum += double(raster::irradiance(light, point, {0, 0, 1}).x);
    return sum;
  }
};

template <class Pipe> std::vector<float> sumLights(const Lighting &scene) {
  std::vector<typename Pipe::Point> points;
  for (glm::vec3 p : scene.points)
    points.push_back({p, int32_t(points.size())});
  Pipe pipe;
  pipe.setDomain({1, 1});
  pipe.state().lights.assign(castAll<typename Pipe::Light>(scene.lights));
  pipe.feed(pipe.light, points);
  pipe.run().orThrow();
  std::vector<float> sums;
  for (size_t i = 0; i < points.size(); ++i)
    sums.push_back(pipe.state().sums[int64_t(i)]);
  return sums;
}

/// The largest relative error.
template <class Pipe> double errorOfSums(const Lighting &scene) {
  std::vector<float> sums = sumLights<Pipe>(scene);
  double error = 0;
  for (size_t i = 0; i < sums.size(); ++i) {
    double exact = scene.exactAt(scene.points[i]);
    error = std::max(error, std::abs(sums[i] - exact) / exact);
  }
  return error;
}

/// What the faint lights bring.
template <class Pipe> Image drawSums() {
  constexpr int side = 48, scale = 4;
  std::vector<float> sums = sumLights<Pipe>(Lighting(200000, side));
  return paint(side * scale, side * scale, [&](int x, int y) {
    float c = sums[y / scale * side + x / scale] - Lighting::sun;
    return rgb(c, c, c);
  });
}

struct LightSums : Mode {
  Description describe() const override {
    return {"LightSums",
            "The sun and many faint lights",
            "faint lights",
            "largest relative error",
            "adds up floats",
            "compensated sum",
            {1e2, 1e3, 1e4, 1e5, 1e6}};
  }
  Errors measure(double lights) const override {
    Lighting scene(int(lights), 3);
    return {errorOfSums<pipelines::PlainLights>(scene),
            errorOfSums<pipelines::CompensatedLights>(scene)};
  }
  Pictures draw() const override {
    return {drawSums<pipelines::PlainLights>(),
            drawSums<pipelines::CompensatedLights>()};
  }
};
const Registration<LightSums> lightSums;

TEST(Failure, LightSums) {
  Errors errors = LightSums().measure(1e6);
  EXPECT_GT(errors.naive, 0.01);
  EXPECT_LE(errors.ours, 0x1p-24);
}

// The tree of reduce() is as good as the float that it gives.
TEST(Failure, LightSumsInPairs) {
  EXPECT_LT(errorOfSums<pipelines::PairwiseLights>(Lighting(1000000, 1)),
            0x1p-22);
}

//===----------------------------------------------------------------------===//
// Steps
//===----------------------------------------------------------------------===//

struct Arrival {
  double time, depth;
};

template <class Pipe> Arrival walk(double steps, float step) {
  std::vector<typename Pipe::Walk> walks{{int32_t(steps), step, 0}};
  Pipe pipe;
  pipe.setDomain({1, 1});
  pipe.feed(pipe.walk, walks);
  pipe.run().orThrow();
  auto arrival = pipe.state().arrivals[0];
  return {arrival.time, arrival.depth};
}

/// A clock that is put forward at each of 60 frames a second.
struct FrameTimes : Mode {
  static constexpr float step = 1.0f / 60;
  Description describe() const override {
    return {"FrameTimes",
            "A clock that is put forward at each frame",
            "frames, 60 a second",
            "error in seconds",
            "adds up floats",
            "compensated sum",
            {1e3, 1e4, 1e5, 1e6, 1e7}};
  }
  Errors measure(double frames) const override {
    auto error = [&](Arrival a) {
      return std::abs(a.time - frames * double(step));
    };
    return {error(walk<pipelines::PlainSteps>(frames, step)),
            error(walk<pipelines::CompensatedSteps>(frames, step))};
  }
};
const Registration<FrameTimes> frameTimes;

TEST(Failure, FrameTimes) {
  Errors day = FrameTimes().measure(60 * 60 * 24);
  EXPECT_GT(day.naive, 1);
  EXPECT_LT(day.ours, 0x1p-7);
}

/// A ray through a fog whose optical depth is 7/6.
struct RayMarching : Mode {
  Description describe() const override {
    return {"RayMarching",
            "The optical depth of a fog",
            "steps through it",
            "relative error",
            "adds up floats",
            "compensated sums",
            {1e3, 1e4, 1e5, 1e6, 1e7}};
  }
  Errors measure(double steps) const override {
    auto error = [](Arrival a) { return std::abs(a.depth * 6 / 7 - 1); };
    auto step = float(1 / steps);
    return {error(walk<pipelines::PlainSteps>(steps, step)),
            error(walk<pipelines::CompensatedSteps>(steps, step))};
  }
};
const Registration<RayMarching> rayMarching;

TEST(Failure, RayMarching) {
  Errors errors = RayMarching().measure(1e7);
  EXPECT_GT(errors.naive, 1e-3);
  EXPECT_LT(errors.ours, 1e-6);
}

//===----------------------------------------------------------------------===//
// Particles
//===----------------------------------------------------------------------===//

struct Orbit {
  static constexpr float speed = 1.2f, step = 0.02f;
  static constexpr double energy = speed * speed / 2 - 1;
};

/// Where particles are that have the same orbit, after so many steps each.
template <class Pipe>
std::vector<typename Pipe::Particle> move(const std::vector<int> &steps) {
  std::vector<typename Pipe::Particle> particles, moved;
  for (int n : steps)
    particles.push_back(
        {{1, 0}, {0, Orbit::speed}, Orbit::step, n, int32_t(particles.size())});
  Pipe pipe;
  pipe.setDomain({1, 1});
  pipe.feed(pipe.move, particles);
  pipe.run().orThrow();
  for (size_t i = 0; i < particles.size(); ++i)
    moved.push_back(pipe.state().moved[int64_t(i)]);
  return moved;
}

template <class Pipe> double errorOfEnergy(double steps) {
  auto p = move<Pipe>({int(steps)})[0];
  glm::dvec2 position(p.position), velocity(p.velocity);
  double energy = glm::dot(velocity, velocity) / 2 - 1 / glm::length(position);
  return std::abs(energy / Orbit::energy - 1);
}

void setPixel(Image &image, glm::vec2 at) {
  if (at.x >= 0 && at.y >= 0 && at.x < image.width && at.y < image.height)
    image.pixels[int(at.y) * image.width + int(at.x)] = rgb(1, 0.9f, 0.3f);
}

template <class Pipe> Image drawOrbit() {
  constexpr int size = 192, dots = 4000;
  std::vector<int> steps(dots);
  for (int i = 0; i < dots; ++i)
    steps[i] = i;
  Image image =
      paint(size, size, [](int, int) { return rgb(0.1f, 0.1f, 0.1f); });
  for (const auto &p : move<Pipe>(steps)) {
    glm::vec2 at = size / 2.0f + p.position * (size / 16.0f);
    setPixel(image, at);
  }
  return image;
}

struct LongOrbits : Mode {
  Description describe() const override {
    return {"LongOrbits",
            "A particle on an elliptic orbit",
            "steps, 500 around the ellipse",
            "relative error of its energy",
            "explicit Euler method",
            "leapfrog, which is symplectic",
            {1e2, 1e3, 1e4, 1e5, 1e6}};
  }
  Errors measure(double steps) const override {
    return {errorOfEnergy<pipelines::EulerParticles>(steps),
            errorOfEnergy<pipelines::LeapfrogParticles>(steps)};
  }
  Pictures draw() const override {
    return {drawOrbit<pipelines::EulerParticles>(),
            drawOrbit<pipelines::LeapfrogParticles>()};
  }
};
const Registration<LongOrbits> longOrbits;

TEST(Failure, LongOrbits) {
  Errors errors = LongOrbits().measure(1e5);
  EXPECT_GT(errors.naive, 0.5);
  EXPECT_LT(errors.ours, 1e-3);
}

//===----------------------------------------------------------------------===//
// Rotations
//===----------------------------------------------------------------------===//

constexpr uint32_t turn = 12345679; // about 1 degree

template <class Pipe>
std::vector<glm::vec2> spin(const std::vector<glm::vec2> &points, int frames) {
  std::vector<typename Pipe::Spinner> spinners;
  for (glm::vec2 p : points)
    spinners.push_back({p, turn, frames, int32_t(spinners.size())});
  Pipe pipe;
  pipe.setDomain({1, 1});
  pipe.feed(pipe.spin, spinners);
  pipe.run().orThrow();
  std::vector<glm::vec2> spun;
  for (size_t i = 0; i < points.size(); ++i)
    spun.push_back(pipe.state().positions[int64_t(i)]);
  return spun;
}

/// How far a point at a distance of 1 is from where it should be.
template <class Pipe> double errorOfSpin(double frames) {
  double angle = std::ldexp(2 * M_PI * uint32_t(turn * uint32_t(frames)), -32);
  glm::dvec2 exact(std::cos(angle), std::sin(angle));
  return glm::distance(exact, glm::dvec2(spin<Pipe>({{1, 0}}, int(frames))[0]));
}

/// A square of dots.
template <class Pipe> Image drawSpin(int frames) {
  constexpr int size = 128, dots = 12;
  std::vector<glm::vec2> points;
  for (int i = 0; i < dots * dots; ++i)
    points.emplace_back(i % dots - dots / 2, i / dots - dots / 2);
  Image image =
      paint(size, size, [](int, int) { return rgb(0.1f, 0.1f, 0.1f); });
  for (glm::vec2 p : spin<Pipe>(points, frames)) {
    glm::vec2 at = size / 2.0f + 7.0f * p;
    for (int i = 0; i < 4; ++i)
      setPixel(image, at + glm::vec2(i % 2, i / 2));
  }
  return image;
}

struct LongSpins : Mode {
  Description describe() const override {
    return {"LongSpins",
            "A rotation by about a degree at each frame",
            "frames",
            "distance from where a point should be, at a radius of 1",
            "turns the last frame's point",
            "phase accumulator in integers",
            {1e2, 1e3, 1e4, 1e5, 1e6, 1e7}};
  }
  Errors measure(double frames) const override {
    return {errorOfSpin<pipelines::RotateSpinners>(frames),
            errorOfSpin<pipelines::PhaseSpinners>(frames)};
  }
  Pictures draw() const override {
    constexpr int frames = 10000000;
    return {drawSpin<pipelines::RotateSpinners>(frames),
            drawSpin<pipelines::PhaseSpinners>(frames)};
  }
};
const Registration<LongSpins> longSpins;

TEST(Failure, LongSpins) {
  Errors errors = LongSpins().measure(1e7);
  EXPECT_GT(errors.naive, 0.1);
  EXPECT_LT(errors.ours, 1e-6);
}

} // namespace
} // namespace failures
