//===- EdgeOverflow.cpp - Edge functions that need more than 32 bits ------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "CheckedEdgeOverflow.h"
#include "NaiveEdgeOverflow.h"
#include "WideEdgeOverflow.h"

#include <cmath>

namespace failures {
namespace {

constexpr int slivers = 24;
constexpr int subpixels = 256;

/// What a pixel shows; -1 for none, -2 for several.
using Shown = std::vector<int>;

/// Of an image, as many rows as it takes for 2^18 pixels, from its middle.
struct Strip {
  int width, height, top;
  explicit Strip(int side)
      : width(side), height(std::min(side, (1 << 18) / side)),
        top((side - height) / 2) {}
};

/// A fan that covers an image with so many pixels a side.
template <class Triangle> std::vector<Triangle> makeFan(int side) {
  const glm::ivec2 hub(side * subpixels / 4 + 77, side * subpixels / 4 - 33);
  auto rim = [&](int i) {
    double angle = 2 * M_PI * (i % slivers) / slivers;
    return hub +
           glm::ivec2(std::lround(std::cos(angle) * 2 * side * subpixels),
                      std::lround(std::sin(angle) * 2 * side * subpixels));
  };
  std::vector<Triangle> fan;
  for (int i = 0; i < slivers; ++i)
    fan.push_back({hub, rim(i), rim(i + 1), i});
  return fan;
}

template <class Pipe> Shown drawFan(int side) {
  auto fan = makeFan<typename Pipe::SnappedTriangle>(side);
  Strip strip(side);
  Pipe pipe;
  pipe.setDomain({strip.width, strip.height});
  pipe.state().top = strip.top;
  pipe.feed(pipe.draw, fan);
  pipe.run().orThrow();
  auto image = pipe.state().image.view();
  Shown shown;
  for (int y = 0; y < strip.height; ++y)
    for (int x = 0; x < strip.width; ++x)
      shown.push_back(image(x, y).draws > 1 ? -2 : image(x, y).triangle);
  return shown;
}

/// On which side of an edge a pixel's centre is, on an edge by the fill rule.
bool isInside(glm::ivec2 a, glm::ivec2 b, int x, int y) {
  __int128 dx = b.x - a.x, dy = b.y - a.y;
  __int128 side = dx * (y * subpixels + subpixels / 2 - a.y) -
                  dy * (x * subpixels + subpixels / 2 - a.x);
  bool isTopOrLeft = dy < 0 || (dy == 0 && dx > 0);
  return side > 0 || (side == 0 && isTopOrLeft);
}

Shown findExact(int side) {
  auto fan = makeFan<pipelines::WideEdgeOverflow::SnappedTriangle>(side);
  Strip strip(side);
  Shown shown;
  for (int y = strip.top; y < strip.top + strip.height; ++y)
    for (int x = 0; x < strip.width; ++x) {
      int found = -1;
      for (const auto &t : fan)
        if (isInside(t.a, t.b, x, y) && isInside(t.b, t.c, x, y) &&
            isInside(t.c, t.a, x, y))
          found = found == -1 ? t.index : -2;
      shown.push_back(found);
    }
  return shown;
}

double percentWrong(const Shown &shown, const Shown &exact) {
  double wrong = 0;
  for (size_t i = 0; i < exact.size(); ++i)
    wrong += shown[i] != exact[i];
  return 100 * wrong / double(exact.size());
}

Image show(const Shown &shown, int side) {
  return paint(side, side, [&](int x, int y) {
    int triangle = shown[y * side + x];
    if (triangle == -2)
      return rgb(1, 0.2f, 0.1f);
    float t = float(triangle) / slivers, shade = triangle % 2 ? 1 : 0.8f;
    return triangle < 0 ? rgb(0, 0, 0)
                        : rgb(shade * (0.3f + 0.6f * t),
                              shade * (0.9f - 0.4f * t), 0.8f * shade);
  });
}

struct EdgeOverflow : Mode {
  Description describe() const override {
    return {"EdgeOverflow",
            "Edge functions in 1/256 pixel",
            "pixels a side of the image",
            "percent of pixels that show something else",
            "32 bits",
            "64 bits",
            {64, 128, 256, 512, 1024, 2048, 4096, 16384}};
  }
  Errors measure(double side) const override {
    Shown exact = findExact(int(side));
    return {
        percentWrong(drawFan<pipelines::NaiveEdgeOverflow>(int(side)), exact),
        percentWrong(drawFan<pipelines::WideEdgeOverflow>(int(side)), exact)};
  }
  Pictures draw() const override {
    return {show(drawFan<pipelines::NaiveEdgeOverflow>(256), 256),
            show(drawFan<pipelines::WideEdgeOverflow>(256), 256)};
  }
};
const Registration<EdgeOverflow> registration;

TEST(Failure, EdgeOverflow) {
  EdgeOverflow mode;
  EXPECT_EQ(mode.measure(64).naive, 0);
  for (int side : {1024, 16384}) {
    Errors errors = mode.measure(side);
    EXPECT_GT(errors.naive, 10) << side;
    EXPECT_EQ(errors.ours, 0) << side;
  }
}

TEST(Failure, CheckedEdgeOverflow) {
  for (int side : {4, 8, 13, 14, 15, 16, 32, 1024})
    EXPECT_EQ(percentWrong(drawFan<pipelines::CheckedEdgeOverflow>(side),
                           findExact(side)),
              0)
        << side;
}

} // namespace
} // namespace failures
