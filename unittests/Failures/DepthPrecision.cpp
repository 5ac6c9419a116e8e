//===- DepthPrecision.cpp - Near layers in scenes that reach far ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "FixedDepth.h"
#include "ReversedDepth.h"

#include <cmath>

namespace failures {
namespace {

constexpr int size = 128;
constexpr int tiles = 8; // a side
/// How much farther away the layer behind is, relatively.
constexpr double gap = 1e-3;

/// A projection with its near plane at 1.
struct Projection {
  double far;
  glm::vec4 place(double x, double y, double w) const {
    double z = ((far + 1) * w - 2 * far) / (far - 1);
    return {float(x * w), float(y * w), float(z), float(w)};
  }
};

/// A tilted square of a tile, in two triangles.
template <class Triangle>
void addSquare(std::vector<Triangle> &triangles, const Projection &projection,
               glm::ivec2 tile, double distance, int layer) {
  auto corner = [&](int i, int j) {
    double x = 2.0 * (tile.x + i) / tiles - 1,
           y = 1 - 2.0 * (tile.y + j) / tiles;
    return projection.place(x, y, distance * (1 + 0.1 * i + 0.05 * j));
  };
  triangles.push_back({corner(0, 0), corner(1, 0), corner(1, 1), layer});
  triangles.push_back({corner(0, 0), corner(1, 1), corner(0, 1), layer});
}

/// In each tile layer 0 hides layer 1, farther away from tile to tile. Of every
/// second tile the layer behind is drawn first.
template <class Pipe> Image drawLayers(double range) {
  std::vector<typename Pipe::LayerTriangle> triangles;
  for (int tile = 0; tile < tiles * tiles; ++tile) {
    glm::ivec2 at(tile % tiles, tile / tiles);
    double distance = 1.1 * std::pow(range / 1.4, tile / (tiles * tiles - 1.0));
    for (int i : {0, 1}) {
      int layer = (i + at.x + at.y) % 2;
      addSquare(triangles, {range}, at, distance * (1 + gap * layer), layer);
    }
  }
  Pipe pipe;
  pipe.setDomain({size, size});
  pipe.feed(pipe.draw, triangles);
  pipe.run().orThrow();
  auto image = pipe.state().image.view();
  return paint(size, size, [&](int x, int y) {
    int layer = image(x, y).layer;
    return layer == 0   ? rgb(0.4f, 0.9f, 0.8f)
           : layer == 1 ? rgb(1, 0.2f, 0.1f)
                        : rgb(0, 0, 0);
  });
}

double percentWrong(const Image &image) {
  double wrong = 0;
  for (const auto &pixel : image.pixels)
    wrong += pixel.rgba.g < 0.5f;
  return 100 * wrong / double(image.pixels.size());
}

struct DepthPrecision : Mode {
  Description describe() const override {
    return {"DepthPrecision",
            "Layers 0.1 percent apart, up to the far plane",
            "distance of the far plane, relative to the near one",
            "percent of pixels that show what is hidden",
            "z / w in 24 bits",
            "reversed depth in floats",
            {10, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8}};
  }
  Errors measure(double range) const override {
    return {percentWrong(drawLayers<pipelines::FixedDepth>(range)),
            percentWrong(drawLayers<pipelines::ReversedDepth>(range))};
  }
  Pictures draw() const override {
    return {drawLayers<pipelines::FixedDepth>(1e6),
            drawLayers<pipelines::ReversedDepth>(1e6)};
  }
};
const Registration<DepthPrecision> registration;

TEST(Failure, DepthPrecision) {
  EXPECT_EQ(DepthPrecision().measure(100).naive, 0);
  Errors errors = DepthPrecision().measure(1e6);
  EXPECT_GT(errors.naive, 10);
  EXPECT_EQ(errors.ours, 0);
}

} // namespace
} // namespace failures
