//===- ReyesCorners.cpp - Patches whose corners tell little of them -------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A patch is diced by how long it is on the screen. Its corners do not tell
// where it crosses the plane of the eye, is seen edge-on, or is folded.
#include "Patches.h"

#include "CornerReyes.h"
#include "ExampleReyes.h"

#include <algorithm>
#include <cmath>

namespace failures {
namespace {

/// Where a ray through a point of the picture is at depth 1.
glm::dvec2 directionAt(const PatchScene &scene, double x, double y) {
  return {2 * x / scene.size - 1, 1 - 2 * y / scene.size};
}

template <class F> Errors compare(const PatchScene &scene, F covers) {
  auto wrong = [&](const Image &image) {
    return double(countMisdrawn(image, [&](double x, double y) {
      return covers(directionAt(scene, x, y));
    }));
  };
  return {wrong(drawPatches<pipelines::CornerReyes>(scene)),
          wrong(drawPatches<pipelines::ExampleReyes>(scene))};
}

Pictures show(const PatchScene &scene) {
  return {drawPatches<pipelines::CornerReyes>(scene),
          drawPatches<pipelines::ExampleReyes>(scene)};
}

constexpr const char *naive = "measures corners";
constexpr const char *ours = "bounds curves, splits at the eye's plane";

/// A level patch below the eye that begins behind it.
struct ReyesEyeSplits : Mode {
  static constexpr double left = -2, right = 3, front = 8;
  static PatchScene makeScene(double behind) {
    PatchScene scene;
    scene.nearZ = 0.05f;
    scene.add([&](int i, int j) {
      return glm::vec3(left + (right - left) * j / 3, -0.5,
                       behind - (front + behind) * i / 3);
    });
    return scene;
  }
  Description describe() const override {
    return {"ReyesEyeSplits",
            "A patch that crosses the eye's plane",
            "how far it reaches behind the eye, at a height of 0.5",
            "wrong pixels",
            naive,
            ours,
            {0.1, 1, 4, 16, 64, 256, 1024}};
  }
  Errors measure(double behind) const override {
    return compare(makeScene(behind), [](glm::dvec2 d) {
      double z = -0.5 / d.y; // where the ray meets the patch's plane
      return d.y < 0 && z < front && d.x * z > left && d.x * z < right;
    });
  }
  Pictures draw() const override { return show(makeScene(64)); }
};
const Registration<ReyesEyeSplits> eyeSplits;

TEST(Failure, ReyesEyeSplits) {
  for (double behind : {64.0, 1024.0}) {
    Errors errors = ReyesEyeSplits().measure(behind);
    EXPECT_GT(errors.naive, 500) << behind;
    EXPECT_EQ(errors.ours, 0) << behind;
  }
}

/// A hump, wide as the view at all depths, whose foot the eye is above.
struct ReyesEdgeOn : Mode {
  static constexpr double nearest = 4, farthest = 12, wide = 0.75;
  static constexpr double bulge = 6; ///< of the control points inside
  static PatchScene makeScene(double height) {
    PatchScene scene;
    scene.add([&](int i, int j) {
      double z = nearest + (farthest - nearest) * j / 3;
      double y = -height + (j % 3 == 0 ? 0 : bulge);
      return glm::vec3(wide * z * (2 * i - 3) / 3, y, -z);
    });
    return scene;
  }
  Description describe() const override {
    return {"ReyesEdgeOn",
            "A hump whose foot is seen edge-on",
            "height of the eye above its foot, which is 8 deep",
            "wrong pixels",
            naive,
            ours,
            {1, 0.5, 0.25, 0.12, 0.06, 0.03, 0}};
  }
  Errors measure(double height) const override {
    return compare(makeScene(height), [=](glm::dvec2 d) {
      auto above = [&](double v) {
        double z = nearest + (farthest - nearest) * v;
        return d.y * z - (3 * bulge * v * (1 - v) - height);
      };
      bool hits = false;
      for (int i = 1; i <= 64 && !hits; ++i)
        hits = above(0) * above(i / 64.0) <= 0;
      return hits && std::abs(d.x) < wide;
    });
  }
  Pictures draw() const override { return show(makeScene(0)); }
};
const Registration<ReyesEdgeOn> edgeOn;

TEST(Failure, ReyesEdgeOn) {
  for (double height : {0.06, 0.0}) {
    Errors errors = ReyesEdgeOn().measure(height);
    EXPECT_GT(errors.naive, 500) << height;
    EXPECT_EQ(errors.ours, 0) << height;
  }
}

/// A flat patch that runs to the right, back to the left, and right again.
struct ReyesFolds : Mode {
  static constexpr double fold = 8;
  /// x at u, whose ends are at -gap and gap.
  static double foldAt(double gap, double u) {
    double s = 1 - u;
    return -gap * s * s * s + 3 * fold * s * s * u - 3 * fold * s * u * u +
           gap * u * u * u;
  }
  static PatchScene makeScene(double gap) {
    PatchScene scene;
    scene.add([&](int i, int j) {
      const double x[4] = {-gap, fold, -fold, gap};
      return glm::vec3(x[i], 2 * j - 3, -4);
    });
    return scene;
  }
  Description describe() const override {
    return {"ReyesFolds",
            "A patch that is folded twice",
            "how near its ends are, in pixels",
            "wrong pixels",
            naive,
            ours,
            {16, 8, 4, 3, 2, 1, 0}};
  }
  Errors measure(double pixels) const override {
    double gap = pixels / 32; // 128 pixels show 8 units
    double reach = 0;
    for (int i = 0; i <= 4096; ++i)
      reach = std::max(reach, foldAt(gap, i / 4096.0));
    return compare(makeScene(gap), [=](glm::dvec2 d) {
      return std::abs(4 * d.x) < reach && std::abs(4 * d.y) < 3;
    });
  }
  Pictures draw() const override { return show(makeScene(0.0625)); }
};
const Registration<ReyesFolds> folds;

TEST(Failure, ReyesFolds) {
  for (double pixels : {2, 0}) {
    Errors errors = ReyesFolds().measure(pixels);
    EXPECT_GT(errors.naive, 1000) << pixels;
    EXPECT_EQ(errors.ours, 0) << pixels;
  }
}

} // namespace
} // namespace failures
