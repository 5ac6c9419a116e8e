//===- BilateralTest.cpp - The bilateral filter under the reference -------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "bilateral/bilateral.piko.cpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace {

using namespace bilateral;

TEST(Bilateral, EqualsALoopOverAllPixels) {
  constexpr int width = 37, height = 21;
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> value(0, 0.2f);
  std::vector<Pixel> pixels;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      pixels.push_back(
          {{x, y}, {value(generator), value(generator), value(generator)}});

  Bilateral pipe;
  pipe.setDomain({width, height});
  pipe.feed(pipe.load, pixels);
  pipe.run();

  for (const Pixel &pixel : pixels) {
    glm::dvec3 sum(0);
    double weights = 0;
    for (int y = -3; y <= 3; ++y)
      for (int x = -3; x <= 3; ++x) {
        int column = std::clamp(pixel.at.x + x, 0, width - 1);
        int row = std::clamp(pixel.at.y + y, 0, height - 1);
        glm::dvec3 color(pixels[row * width + column].color);
        glm::dvec3 difference = color - glm::dvec3(pixel.color);
        double weight = std::exp(-(x * x + y * y) / 8.0 -
                                 glm::dot(difference, difference) / 0.02);
        sum += weight * color;
        weights += weight;
      }
    glm::dvec3 output(pipe.state().output(pixel.at));
    EXPECT_LT(glm::distance(output, sum / weights), 1e-6);
  }
}

// An edge that is far higher than sigmaColor stays as it is.
TEST(Bilateral, KeepsEdges) {
  std::vector<Pixel> pixels;
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 20; ++x)
      pixels.push_back({{x, y}, glm::vec3(x < 10 ? 0.0f : 4.0f)});
  Bilateral pipe;
  pipe.setDomain({20, 20});
  pipe.feed(pipe.load, pixels);
  pipe.run();
  for (const Pixel &pixel : pixels)
    EXPECT_NEAR(pipe.state().output(pixel.at).x, pixel.color.x, 1e-5f);
}

} // namespace
