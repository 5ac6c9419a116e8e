//===- GuardBand.cpp - Triangles that span the screen very often ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "ClipSpace.h"

namespace failures {
namespace {

using namespace clipspace;

constexpr int slivers = 22;

/// A fan that reaches so many times as far as the image.
std::vector<Triangle> makeFan(double reach) {
  auto rim = [&](int i) {
    double angle = 2 * M_PI * (i % slivers + 0.3) / slivers;
    return glm::vec4(reach * std::cos(angle), reach * std::sin(angle), 0, 1);
  };
  std::vector<Triangle> fan;
  for (int i = 0; i < slivers; ++i)
    fan.push_back({{0.13f, 0.07f, 0, 1}, rim(i), rim(i + 1), i});
  return fan;
}

/// Of a window that a fan covers, in percent: what is not drawn exactly once,
/// or clearly shows another triangle.
template <class Pipe>
double findWrong(const std::vector<Triangle> &fan, const Window &w) {
  Shown shown = drawTriangles<Pipe>(fan, w), exact = findExact(fan, w, 0.01);
  double wrong = 0;
  for (size_t i = 0; i < exact.size(); ++i)
    wrong += shown[i] < 0 || (exact[i] >= 0 && shown[i] != exact[i]);
  return 100 * wrong / double(exact.size());
}

Errors measureIn(const Window &w, double reach) {
  std::vector<Triangle> fan = makeFan(reach);
  return {findWrong<pipelines::DividedTriangles>(fan, w),
          findWrong<pipelines::ClippedTriangles>(fan, w)};
}

struct GuardBand : Mode {
  Description describe() const override {
    return {"GuardBand",
            "Triangles far larger than the screen",
            "reach in half images",
            "percent of pixels that show something else",
            "no guard band",
            "clipped at a guard band",
            {10, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8}};
  }
  Errors measure(double reach) const override {
    return measureIn(Window(128), reach);
  }
  Pictures draw() const override { return drawBoth(makeFan(1e6), 192); }
};
const Registration<GuardBand> registration;

TEST(Failure, GuardBand) {
  for (double reach : {1e6, 1e8}) {
    Errors errors = GuardBand().measure(reach);
    EXPECT_GT(errors.naive, 10) << reach;
    EXPECT_EQ(errors.ours, 0) << reach;
  }
}

TEST(Failure, GuardBandOfLargeImage) {
  // Through the hub, where all triangles meet.
  Errors errors = measureIn(Window(16384, 9000, 7600, 512, 64), 1e6);
  EXPECT_GT(errors.naive, 10);
  EXPECT_EQ(errors.ours, 0);
}

} // namespace
} // namespace failures
