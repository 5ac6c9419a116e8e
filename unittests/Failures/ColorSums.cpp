//===- ColorSums.cpp - Sums of many, very dim and negative lights ---------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "ClampedColors.h"
#include "FloatColors.h"
#include "FlushedColors.h"
#include "HalfColors.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace failures {
namespace {

constexpr int measured = 64, drawn = 128; // pixels a side

using Glow = pipelines::FloatColors::Glow;
/// Of all channels, pixel by pixel.
using Sums = std::vector<double>;

/// Lights in random places, brighter ones and less bright ones.
std::vector<Glow> placeLights(int count, int size, double power) {
  std::minstd_rand random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Glow> lights(static_cast<size_t>(count));
  for (Glow &g : lights) {
    double x = unit(random), y = unit(random), reach = 0.2 + 0.4 * unit(random);
    double p = power * (0.5 + unit(random)), tint = unit(random);
    g.at = {float(x * size), float(y * size)};
    g.reach = float(reach * size);
    g.color = {float(p), float(p * (0.9 - 0.4 * tint)),
               float(p * (0.3 + 0.5 * tint))};
  }
  return lights;
}

float valueOf(const pipelines::ClampedColors::ClampedSum &s) { return s.value; }
float valueOf(const pipelines::FlushedColors::FlushedSum &s) { return s.value; }
float valueOf(const pipelines::FloatColors::FloatSum &s) { return s.value; }
double valueOf(const pipelines::HalfColors::HalfSum &s) {
  int exponent = s.bits >> 10 & 31, fraction = s.bits & 0x3ff;
  double size = exponent == 31  ? INFINITY
                : exponent == 0 ? std::ldexp(fraction, -24)
                                : std::ldexp(fraction + 1024, exponent - 25);
  return s.bits & 0x8000 ? -size : size;
}

template <class Pipe> Sums addUp(const std::vector<Glow> &lights, int size) {
  Pipe pipe;
  pipe.setDomain({size, size});
  pipe.feed(0, static_cast<const void *>(lights.data()),
            int64_t(lights.size()));
  pipe.run().orThrow();
  auto image = pipe.state().image.view();
  Sums sums;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      for (auto *channel :
           {&image(x, y).red, &image(x, y).green, &image(x, y).blue})
        sums.push_back(valueOf(*channel));
  return sums;
}

Sums addExactly(const std::vector<Glow> &lights, int size) {
  Sums sums(size_t(size) * size * 3);
  for (const Glow &g : lights)
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x) {
        double dx = (x + 0.5 - g.at.x) / g.reach,
               dy = (y + 0.5 - g.at.y) / g.reach;
        double falloff = std::max(0.0, 1 - dx * dx - dy * dy);
        for (int c = 0; c < 3; ++c)
          sums[(size_t(y) * size + x) * 3 + c] += g.color[c] * falloff;
      }
  return sums;
}

/// As shown with such an exposure.
double expose(double sum, double exposure) {
  return std::clamp(sum * exposure, 0.0, 1.0);
}

/// One that shows the brightest pixel as 1.
double exposureOf(const Sums &exact) {
  return 1 / *std::max_element(exact.begin(), exact.end());
}

double percentWrong(const Sums &sums, const Sums &exact, double exposure) {
  double wrong = 0;
  for (size_t i = 0; i < exact.size(); ++i)
    wrong += std::abs(expose(sums[i], exposure) - expose(exact[i], exposure));
  return 100 * wrong / double(exact.size());
}

template <class Naive>
Errors compare(const std::vector<Glow> &lights, double exposure = 0) {
  Sums exact = addExactly(lights, measured);
  exposure = exposure > 0 ? exposure : exposureOf(exact);
  return {percentWrong(addUp<Naive>(lights, measured), exact, exposure),
          percentWrong(addUp<pipelines::FloatColors>(lights, measured), exact,
                       exposure)};
}

Image show(const Sums &sums, double exposure) {
  return paint(drawn, drawn, [&](int x, int y) {
    const double *pixel = &sums[(size_t(y) * drawn + x) * 3];
    return rgb(float(expose(pixel[0], exposure)),
               float(expose(pixel[1], exposure)),
               float(expose(pixel[2], exposure)));
  });
}

template <class Naive>
Pictures drawBoth(const std::vector<Glow> &lights, double exposure = 0) {
  Sums ours = addUp<pipelines::FloatColors>(lights, drawn);
  exposure = exposure > 0 ? exposure : exposureOf(ours);
  return {show(addUp<Naive>(lights, drawn), exposure), show(ours, exposure)};
}

struct HalfSums : Mode {
  Description describe() const override {
    return {"HalfSums",
            "Many lights, of 20 each",
            "lights",
            "mean error, in percent of the brightest pixel",
            "sums in half floats",
            "sums in floats",
            {1, 10, 100, 1000, 3000, 1e4, 3e4}};
  }
  Errors measure(double count) const override {
    return compare<pipelines::HalfColors>(
        placeLights(int(count), measured, 20));
  }
  Pictures draw() const override {
    return drawBoth<pipelines::HalfColors>(placeLights(3000, drawn, 200));
  }
};
const Registration<HalfSums> halfSums;

struct NegativeLights : Mode {
  /// Lights, and as many that take most of theirs away again.
  static std::vector<Glow> scene(int count, int size) {
    std::vector<Glow> lights = placeLights(count, size, 0.4);
    for (int i = 0; i < count; ++i) {
      lights.push_back(lights[i]);
      lights.back().color *= i % 4 == 0 ? -0.4f : -1.0f;
    }
    return lights;
  }
  Description describe() const override {
    return {"NegativeLights",
            "Lights that take light away",
            "lights, and as many negative ones",
            "mean error, in percent of full brightness",
            "clamped to 0 to 1 at each step",
            "clamped when it is shown",
            {1, 3, 10, 30, 100, 300, 1000}};
  }
  Errors measure(double count) const override {
    return compare<pipelines::ClampedColors>(scene(int(count), measured));
  }
  Pictures draw() const override {
    return drawBoth<pipelines::ClampedColors>(scene(16, drawn), 1);
  }
};
const Registration<NegativeLights> negativeLights;

struct DimLights : Mode {
  Description describe() const override {
    return {"DimLights",
            "Dim lights and a long exposure",
            "power of ten by which the lights are dimmed",
            "mean error, in percent of the brightest pixel",
            "denormals are flushed to 0",
            "denormals are kept",
            {10, 30, 36, 37, 38, 39, 40, 42}};
  }
  Errors measure(double power) const override {
    return compare<pipelines::FlushedColors>(
        placeLights(100, measured, std::pow(10, -power)));
  }
  Pictures draw() const override {
    return drawBoth<pipelines::FlushedColors>(placeLights(100, drawn, 2e-38));
  }
};
const Registration<DimLights> dimLights;

TEST(Failure, HalfSums) {
  // From 32768 on half floats are 32 apart: less than 16 change nothing.
  Errors stagnant = HalfSums().measure(30000);
  EXPECT_GT(stagnant.naive, 10);
  EXPECT_LT(stagnant.ours, 0.001);
  // Beyond 65504 there is infinity.
  Errors infinite =
      compare<pipelines::HalfColors>(placeLights(100, measured, 1e4));
  EXPECT_GT(infinite.naive, 20);
  EXPECT_LT(infinite.ours, 0.0001);
}

TEST(Failure, NegativeLights) {
  Errors errors = NegativeLights().measure(100);
  EXPECT_GT(errors.naive, 20);
  EXPECT_LT(errors.ours, 0.001);
}

TEST(Failure, DimLights) {
  Errors errors = DimLights().measure(40);
  EXPECT_GT(errors.naive, 20);
  EXPECT_LT(errors.ours, 0.001);
}

} // namespace
} // namespace failures
