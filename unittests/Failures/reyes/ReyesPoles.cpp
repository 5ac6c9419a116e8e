//===- ReyesPoles.cpp - Patches with an edge that is a point --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where one edge of a patch is a point, as at the pole of a sphere, a
// derivative is zero there, and the normal is no number.
#include "Patches.h"

#include "ExampleReyes.h"
#include "OwnRateReyes.h"

#include <cmath>

namespace failures {
namespace {

/// n by n caps of four patches that meet at a pole.
PatchScene makeCaps(int n) {
  PatchScene scene;
  scene.size = 256;
  scene.rate = 4;
  double radius = 3.6 / n;
  for (int k = 0; k < 4 * n * n; ++k) {
    double angle = M_PI / 2 * (k % 4), c = std::cos(angle), s = std::sin(angle);
    int column = k / 4 % n, row = k / 4 / n;
    double x = radius * (2 * column + 1) - 3.6;
    double y = radius * (2 * row + 1) - 3.6;
    scene.add([&](int i, int j) {
      const double weights[4][2] = {{1, 0}, {1, 0.55}, {0.55, 1}, {0, 1}};
      double a = weights[j][0] * i / 3, b = weights[j][1] * i / 3;
      return glm::vec3(x + radius * (c * a - s * b),
                       y + radius * (s * a + c * b),
                       -4 - radius * (i < 2 ? 0 : (i - 1) / 2.0));
    });
  }
  return scene;
}

/// Pixels next to a pole, whose normal is the z axis there, that are far from
/// as bright as it.
int countBlots(const PatchScene &scene, const Image &image) {
  const double exact = 0.8 * (0.05 + 0.64);
  int blots = 0;
  for (size_t k = 0; k < scene.patches.size(); k += 4) {
    glm::vec3 pole = scene.patches[k].points[0];
    auto x = int(scene.size * 0.5 * (1 - pole.x / pole.z) - 0.5);
    auto y = int(scene.size * 0.5 * (1 + pole.y / pole.z) - 0.5);
    for (int i = 0; i < 4; ++i) {
      int pixel = (y + i / 2) * scene.size + x + i % 2;
      float color = image.pixels[pixel].rgba.x;
      blots += !(std::abs(color - exact) < 0.25);
    }
  }
  return blots;
}

struct ReyesPoles : Mode {
  Description describe() const override {
    return {"ReyesPoles",
            "Patches with an edge that is a point",
            "poles",
            "black pixels, of 4 next to each pole",
            "normals at the vertices of micropolygons",
            "normals at their middles, or towards the eye",
            {1, 4, 9, 16, 25, 36}};
  }
  Errors measure(double poles) const override {
    PatchScene scene = makeCaps(int(std::sqrt(poles)));
    auto blots = [&](const Image &image) {
      return double(countBlots(scene, image));
    };
    return {blots(drawPatches<pipelines::OwnRateReyes>(scene)),
            blots(drawPatches<pipelines::ExampleReyes>(scene))};
  }
  Pictures draw() const override {
    PatchScene scene = makeCaps(3);
    return {drawPatches<pipelines::OwnRateReyes>(scene),
            drawPatches<pipelines::ExampleReyes>(scene)};
  }
};
const Registration<ReyesPoles> registration;

TEST(Failure, ReyesPoles) {
  for (int poles : {1, 9, 36}) {
    Errors errors = ReyesPoles().measure(poles);
    EXPECT_GE(errors.naive, 2 * poles);
    EXPECT_EQ(errors.ours, 0);
  }
}

} // namespace
} // namespace failures
