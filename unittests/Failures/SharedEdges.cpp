//===- SharedEdges.cpp - Holes, and pixels that are drawn twice -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "ExactSharedEdges.h"
#include "NaiveSharedEdges.h"

#include <cmath>

namespace failures {
namespace {

constexpr int size = 128;
constexpr float radius = 60;

/// How often each pixel is drawn by a fan of so many slivers, whose hub is on
/// a pixel's centre, as are some of its rim.
template <class Pipe> std::vector<int> drawFan(int slivers) {
  using Triangle = typename Pipe::FlatTriangle;
  const glm::vec2 hub(size / 2 + 0.5f);
  auto rim = [&](int i) {
    double angle = 2 * M_PI * (i % slivers) / slivers;
    return hub + radius * glm::vec2(std::cos(angle), std::sin(angle));
  };
  std::vector<Triangle> triangles;
  for (int i = 0; i < slivers; ++i)
    triangles.push_back({hub, rim(i), rim(i + 1)});
  Pipe pipe;
  pipe.setDomain({size, size});
  pipe.feed(pipe.draw, triangles);
  pipe.run().orThrow();
  auto image = pipe.state().image.view();
  std::vector<int> draws;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      draws.push_back(image(x, y).draws);
  return draws;
}

/// Pixels well inside that are not drawn exactly once.
int countWrong(const std::vector<int> &draws) {
  int wrong = 0;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      if (std::hypot(x - size / 2, y - size / 2) < radius - 8)
        wrong += draws[y * size + x] != 1;
  return wrong;
}

Image show(const std::vector<int> &draws) {
  return paint(size, size, [&](int x, int y) {
    int n = draws[y * size + x];
    return n == 0   ? rgb(0, 0, 0)
           : n == 1 ? rgb(0.8f, 0.8f, 0.8f)
                    : rgb(1, 0.2f, 0.1f);
  });
}

struct SharedEdges : Mode {
  Description describe() const override {
    return {"SharedEdges",
            "Triangles that share edges",
            "slivers of a fan",
            "pixels not drawn exactly once",
            "edge functions in floats",
            "exact edge functions with a fill rule",
            {12, 30, 100, 300, 1000, 3000, 10000}};
  }
  Errors measure(double slivers) const override {
    return {
        double(countWrong(drawFan<pipelines::NaiveSharedEdges>(int(slivers)))),
        double(countWrong(drawFan<pipelines::ExactSharedEdges>(int(slivers))))};
  }
  Pictures draw() const override {
    return {show(drawFan<pipelines::NaiveSharedEdges>(100)),
            show(drawFan<pipelines::ExactSharedEdges>(100))};
  }
};
const Registration<SharedEdges> registration;

TEST(Failure, SharedEdges) {
  Errors few = SharedEdges().measure(100), many = SharedEdges().measure(10000);
  EXPECT_GT(few.naive, 10);
  EXPECT_GT(many.naive, 10);
  EXPECT_EQ(few.ours, 0);
  EXPECT_EQ(many.ours, 0);
}

} // namespace
} // namespace failures
