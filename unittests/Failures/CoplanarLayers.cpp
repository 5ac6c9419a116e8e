//===- CoplanarLayers.cpp - Z-fighting ------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "InterpolatedLayers.h"
#include "SupportingLayers.h"

#include <random>

namespace failures {
namespace {

constexpr int size = 128;
constexpr int cells = 6; // of a layer's mesh, a side

/// A slanted plane: z / w at the middle, and its slopes.
struct Plane {
  double middle = 0.5, slopeX = 0.3, slopeY = -0.15;

  /// A corner with some w of its own, as perspective makes it.
  glm::vec4 place(double x, double y) const {
    double w = 1 / (0.6 - 0.2 * x + 0.1 * y);
    double z = middle + slopeX * x + slopeY * y;
    return {float(x * w), float(y * w), float(z * w), float(w)};
  }
  /// As a function of the pixel.
  glm::vec3 onScreen() const {
    double x = 2 * slopeX / size, y = -2 * slopeY / size;
    double origin =
        middle - slopeX * (1 - 1.0 / size) + slopeY * (1 - 1.0 / size);
    return {float(x), float(y), float(origin)};
  }
};

/// A mesh over the whole image whose inner vertices are a layer's own.
template <class Triangle>
void addLayer(std::vector<Triangle> &triangles, int layer) {
  std::minstd_rand random(layer + 1);
  std::uniform_real_distribution<double> offset(-0.08, 0.08);
  const Plane plane;
  std::vector<glm::vec4> vertices;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i) {
      bool isBorder = i == 0 || j == 0 || i == cells || j == cells;
      double x = 2.0 * i / cells - 1, y = 1 - 2.0 * j / cells;
      double dx = offset(random), dy = offset(random);
      vertices.push_back(isBorder ? plane.place(1.2 * x, 1.2 * y)
                                  : plane.place(x + dx, y + dy));
    }
  auto add = [&](int a, int b, int c) {
    triangles.push_back(
        {vertices[a], vertices[b], vertices[c], plane.onScreen(), layer});
  };
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      int at = j * (cells + 1) + i, below = at + cells + 1;
      add(at, at + 1, below + 1);
      add(at, below + 1, below);
    }
}

/// What the pixels show of so many layers.
template <class Pipe> std::vector<int> drawLayers(int layers) {
  std::vector<typename Pipe::LayerTriangle> triangles;
  for (int i = 0; i < layers; ++i)
    addLayer(triangles, i);
  Pipe pipe;
  pipe.setDomain({size, size});
  pipe.feed(pipe.draw, triangles);
  pipe.run().orThrow();
  auto image = pipe.state().image.view();
  std::vector<int> shown;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      shown.push_back(image(x, y).layer);
  return shown;
}

double percentWrong(const std::vector<int> &shown) {
  double wrong = 0;
  for (int layer : shown)
    wrong += layer != 0;
  return 100 * wrong / double(shown.size());
}

Image show(const std::vector<int> &shown) {
  return paint(size, size, [&](int x, int y) {
    int layer = shown[y * size + x];
    float t = float(layer % 4) / 3;
    return layer == 0  ? rgb(0.4f, 0.9f, 0.8f)
           : layer < 0 ? rgb(0, 0, 0)
                       : rgb(1 - 0.5f * t, 0.2f + 0.3f * t, 0.1f + 0.4f * t);
  });
}

struct CoplanarLayers : Mode {
  Description describe() const override {
    return {"CoplanarLayers",
            "Coplanar layers, of which the first is seen",
            "layers",
            "percent of pixels that show another layer",
            "depth interpolated in each triangle",
            "depth of the supporting plane",
            {1, 2, 3, 5, 10, 20, 50}};
  }
  Errors measure(double layers) const override {
    return {
        percentWrong(drawLayers<pipelines::InterpolatedLayers>(int(layers))),
        percentWrong(drawLayers<pipelines::SupportingLayers>(int(layers)))};
  }
  Pictures draw() const override {
    return {show(drawLayers<pipelines::InterpolatedLayers>(2)),
            show(drawLayers<pipelines::SupportingLayers>(2))};
  }
};
const Registration<CoplanarLayers> registration;

TEST(Failure, CoplanarLayers) {
  Errors two = CoplanarLayers().measure(2), ten = CoplanarLayers().measure(10);
  EXPECT_GT(two.naive, 20);
  EXPECT_GT(ten.naive, 50);
  EXPECT_EQ(two.ours, 0);
  EXPECT_EQ(ten.ours, 0);
}

} // namespace
} // namespace failures
