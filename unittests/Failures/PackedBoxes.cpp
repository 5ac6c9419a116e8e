//===- PackedBoxes.cpp - Boxes of pixels in 16 bits -----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "PackedBoxes.h"
#include "WideBoxes.h"

#include <algorithm>

namespace failures {
namespace {

constexpr int height = 8;
constexpr int subpixels = 256;

/// Rectangles of two triangles that cover an image of this width.
template <class Triangle> std::vector<Triangle> makeRectangles(int width) {
  std::vector<Triangle> triangles;
  constexpr int across = 1000; // pixels of a rectangle, at most
  for (int x = 0; x < width; x += across) {
    glm::ivec2 lo(x * subpixels, 0);
    glm::ivec2 hi(std::min(x + across, width) * subpixels, height * subpixels);
    triangles.push_back({lo, {hi.x, lo.y}, hi});
    triangles.push_back({lo, hi, {lo.x, hi.y}});
  }
  return triangles;
}

/// Of an image that the rectangles cover, in percent: what is not drawn exactly
/// once.
template <class Pipe> double percentWrong(int width) {
  auto triangles = makeRectangles<typename Pipe::SnappedTriangle>(width);
  Pipe pipe;
  pipe.setDomain({width, height});
  pipe.feed(pipe.setup, triangles);
  pipe.run().orThrow();
  auto image = pipe.state().image.view();
  double wrong = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      wrong += image(x, y).draws != 1;
  return 100 * wrong / (double(width) * height);
}

struct PackedBoxes : Mode {
  Description describe() const override {
    return {"PackedBoxes",
            "Rows of triangles in wide images",
            "pixels a row",
            "percent of pixels not drawn exactly once",
            "boxes of 16-bit coordinates",
            "boxes of 32-bit coordinates",
            {1024, 16384, 32768, 32769, 40000, 65536, 131072}};
  }
  Errors measure(double width) const override {
    return {percentWrong<pipelines::PackedBoxes>(int(width)),
            percentWrong<pipelines::WideBoxes>(int(width))};
  }
};
const Registration<PackedBoxes> registration;

TEST(Failure, PackedBoxes) {
  EXPECT_EQ(PackedBoxes().measure(32768).naive, 0);
  EXPECT_GT(PackedBoxes().measure(32769).naive, 0);
  Errors errors = PackedBoxes().measure(65536);
  EXPECT_GT(errors.naive, 40);
  EXPECT_EQ(errors.ours, 0);
}

} // namespace
} // namespace failures
