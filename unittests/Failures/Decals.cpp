//===- Decals.cpp - What is painted on a surface, and what hides it -------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "AttachedDecals.h"
#include "BiasedDecals.h"

namespace failures {
namespace {

constexpr int size = 128;
constexpr int stripe = 8; // pixels
/// Rows of a panel that is 0.1 percent nearer to the eye than the wall.
constexpr int panelBegin = 40, panelEnd = 88;
constexpr int wall = 0, panel = 1;

bool isStripe(int x) { return x / stripe % 2 == 1; }

/// A wall that recedes from distance 1 at the left to `reach` at the right,
/// seen with a near plane at 0.1 and a far one at 1000.
struct Wall {
  double reach;

  /// At a pixel's corner; nearer to the eye by a factor.
  glm::vec4 place(double x, double y, double factor) const {
    const double near = 0.1, far = 1000;
    double sx = 2 * x / size - 1, sy = 1 - 2 * y / size;
    double w = factor / (1 + (1 / reach - 1) * (sx + 1) / 2);
    double z = ((far + near) * w - 2 * far * near) / (far - near);
    return {float(sx * w), float(sy * w), float(z), float(w)};
  }
};

template <class Pipe> class Scene {
public:
  explicit Scene(double reach) : plane{reach} {
    add(0, 0, size, size, 1, wall, 0);
    add(0, panelBegin, size, panelEnd, 0.999, panel, 0);
    for (int x = 0; x < size; x += stripe)
      if (isStripe(x))
        add(x, 0, x + stripe, size, 1, wall, 1 + x / stripe);
  }

  std::vector<glm::ivec2> draw() const {
    Pipe pipe;
    pipe.setDomain({size, size});
    pipe.feed(pipe.draw, triangles);
    pipe.run().orThrow();
    auto image = pipe.state().image.view();
    std::vector<glm::ivec2> shown;
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x)
        shown.push_back({image(x, y).surface, image(x, y).decal});
    return shown;
  }

private:
  void add(int x0, int y0, int x1, int y1, double factor, int surface,
           int decal) {
    glm::vec4 a = plane.place(x0, y0, factor), b = plane.place(x1, y0, factor),
              c = plane.place(x1, y1, factor), d = plane.place(x0, y1, factor);
    triangles.push_back({a, b, c, surface, decal});
    triangles.push_back({a, c, d, surface, decal});
  }

  Wall plane;
  std::vector<typename Pipe::PaintedTriangle> triangles;
};

/// What a pixel ought to show: a surface and a decal.
glm::ivec2 findExact(int x, int y) {
  if (y >= panelBegin && y < panelEnd)
    return {panel, 0};
  return {wall, isStripe(x) ? 1 + x / stripe : 0};
}

template <class Pipe> double percentWrong(double reach) {
  std::vector<glm::ivec2> shown = Scene<Pipe>(reach).draw();
  double wrong = 0;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      wrong += shown[y * size + x] != findExact(x, y);
  return 100 * wrong / (size * size);
}

template <class Pipe> Image show(double reach) {
  std::vector<glm::ivec2> shown = Scene<Pipe>(reach).draw();
  return paint(size, size, [&](int x, int y) {
    glm::ivec2 pixel = shown[y * size + x];
    return pixel.y > 0        ? rgb(1, 0.6f, 0.1f)
           : pixel.x == panel ? rgb(0.25f, 0.35f, 0.6f)
                              : rgb(0.8f, 0.8f, 0.8f);
  });
}

struct Decals : Mode {
  Description describe() const override {
    return {"Decals",
            "Decals on a wall, behind a panel",
            "how far the wall recedes",
            "percent of pixels that show something else",
            "moved by a constant bias",
            "drawn where their surface is seen",
            {1.5, 2, 3, 5, 10, 30, 100, 300}};
  }
  Errors measure(double reach) const override {
    return {percentWrong<pipelines::BiasedDecals>(reach),
            percentWrong<pipelines::AttachedDecals>(reach)};
  }
  Pictures draw() const override {
    return {show<pipelines::BiasedDecals>(100),
            show<pipelines::AttachedDecals>(100)};
  }
};
const Registration<Decals> registration;

TEST(Failure, Decals) {
  EXPECT_EQ(Decals().measure(1.5).naive, 0);
  Errors errors = Decals().measure(300);
  EXPECT_GT(errors.naive, 5);
  EXPECT_EQ(errors.ours, 0);
}

} // namespace
} // namespace failures
