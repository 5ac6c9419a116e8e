//===- ReyesCracks.cpp - Patches that are diced at other rates ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Patches.h"

#include "ExampleReyes.h"
#include "OwnRateReyes.h"

#include <algorithm>
#include <cmath>

namespace failures {
namespace {

/// A flat sheet of patches that reaches beyond the picture on all sides. Their
/// borders are S-shaped, and every other one is folded inside.
PatchScene makeSheet(double rate) {
  constexpr int side = 5;
  PatchScene scene;
  scene.size = 256;
  scene.rate = float(rate);
  auto bend = [](int i) { return i % 3 == 0 ? 0 : i % 3 == 1 ? 1.5 : -1.5; };
  auto point = [&](int i, int j) {
    double right = i + bend(j), up = j - bend(i);
    return glm::vec3(0.5 * right - 3.7, 0.5 * up - 3.7, -2);
  };
  for (int a = 0; a < side; ++a)
    for (int b = 0; b < side; ++b)
      scene.add([&](int i, int j) {
        bool isTurned = (a + b) % 2 == 1 && i % 3 != 0 && j % 3 != 0;
        return isTurned ? point(3 * a + 3 - i, 3 * b + 3 - j)
                        : point(3 * a + i, 3 * b + j);
      });
  return scene;
}

int countHoles(const Image &image) {
  return int(std::count_if(image.pixels.begin(), image.pixels.end(),
                           [](const auto &c) { return c.rgba.a == 0; }));
}

struct ReyesCracks : Mode {
  Description describe() const override {
    return {"ReyesCracks",
            "Patches that are diced at other rates",
            "longest edge of a micropolygon, in pixels",
            "holes in a sheet, in pixels",
            "each piece by its own rate",
            "borders by a rate of their own",
            {1, 2, 4, 8, 16, 32, 64}};
  }
  Errors measure(double rate) const override {
    PatchScene scene = makeSheet(rate);
    return {double(countHoles(drawPatches<pipelines::OwnRateReyes>(scene))),
            double(countHoles(drawPatches<pipelines::ExampleReyes>(scene)))};
  }
  Pictures draw() const override {
    PatchScene scene = makeSheet(16);
    return {showHoles(drawPatches<pipelines::OwnRateReyes>(scene)),
            showHoles(drawPatches<pipelines::ExampleReyes>(scene))};
  }
};
const Registration<ReyesCracks> registration;

TEST(Failure, ReyesCracks) {
  for (double rate : {8, 16, 64}) {
    Errors errors = ReyesCracks().measure(rate);
    EXPECT_GT(errors.naive, 10) << rate;
    EXPECT_EQ(errors.ours, 0) << rate;
  }
}

} // namespace
} // namespace failures
