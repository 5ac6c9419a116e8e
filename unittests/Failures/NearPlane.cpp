//===- NearPlane.cpp - Triangles at, behind and around the eye ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "ClipSpace.h"

namespace failures {
namespace {

using namespace clipspace;

constexpr int size = 128;

/// A floor below the eye, of strips that run from one distance to another;
/// negative ones are behind the eye.
std::vector<Triangle> makeFloor(float below, float from, float to,
                                float nearest = 0.01f) {
  auto place = [&](int i, float distance) {
    return glm::vec4((i - 4) * 1.3f + 0.1f, -below, distance - 2 * nearest,
                     distance);
  };
  std::vector<Triangle> floor;
  for (int i = 0; i < 9; ++i) {
    floor.push_back({place(i, from), place(i + 1, from), place(i + 1, to),
                     int(floor.size())});
    floor.push_back(
        {place(i, from), place(i + 1, to), place(i, to), int(floor.size())});
  }
  return floor;
}

struct NearZeroW : Mode {
  static std::vector<Triangle> scene(double inverse) {
    return makeFloor(1, float(1 / inverse), 20);
  }
  Description describe() const override {
    return {"NearZeroW",
            "Triangles that reach up to the eye",
            "1 / w of the nearest corners",
            "percent of pixels that show something else",
            "divided by w",
            "clipped before",
            {1, 1e2, 1e4, 1e5, 1e6, 1e8, 1e10}};
  }
  Errors measure(double inverse) const override {
    return compare(scene(inverse), Window(size), 0.01);
  }
  Pictures draw() const override { return drawBoth(scene(1e6), 192); }
};
const Registration<NearZeroW> nearZeroW;

struct BehindEye : Mode {
  static std::vector<Triangle> scene(double behind) {
    return makeFloor(1, float(1 - behind), 20);
  }
  Description describe() const override {
    return {"BehindEye",
            "Triangles that reach behind the eye",
            "how far they do, in heights of the eye, and 1",
            "percent of pixels that show something else",
            "divided by w",
            "clipped before",
            {0, 0.5, 1, 1.5, 2, 5, 20, 100}};
  }
  Errors measure(double behind) const override {
    return compare(scene(behind), Window(size), 0.01);
  }
  Pictures draw() const override { return drawBoth(scene(2), 192); }
};
const Registration<BehindEye> behindEye;

struct EyeInTriangle : Mode {
  static std::vector<Triangle> scene(double inverse) {
    return makeFloor(float(1 / inverse), -3, 20, float(0.25 / inverse));
  }
  Description describe() const override {
    return {"EyeInTriangle",
            "The eye comes down on a triangle",
            "1 / height of the eye",
            "percent of pixels that show something else",
            "divided by w",
            "clipped before",
            {1, 1e2, 1e4, 1e5, 1e6, 1e7, 1e8}};
  }
  Errors measure(double inverse) const override {
    return compare(scene(inverse), Window(size), 0.01);
  }
  Pictures draw() const override { return drawBoth(scene(20), 192); }
};
const Registration<EyeInTriangle> eyeInTriangle;

void expectFailure(const Errors &errors) {
  EXPECT_GT(errors.naive, 10);
  EXPECT_EQ(errors.ours, 0);
}

TEST(Failure, NearZeroW) {
  expectFailure(NearZeroW().measure(1e8));
  expectFailure(compare(makeFloor(1, 0, 20), Window(size), 0.01));
}

TEST(Failure, BehindEye) {
  expectFailure(BehindEye().measure(2));
  expectFailure(BehindEye().measure(100));
  // All of it: nothing is seen.
  expectFailure(compare(makeFloor(1, -20, -1), Window(size), 0.01));
}

TEST(Failure, EyeInTriangle) {
  expectFailure(EyeInTriangle().measure(10));
  expectFailure(EyeInTriangle().measure(1e6));
  // Seen from the side: nothing is seen.
  EXPECT_EQ(compare(makeFloor(0, -3, 20), Window(size), 0.01).ours, 0);
}

} // namespace
} // namespace failures
