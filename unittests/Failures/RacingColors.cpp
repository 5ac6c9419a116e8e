//===- RacingColors.cpp - Depth and colour that disagree ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "ColorsApart.h"
#include "ColorsTogether.h"

#include <algorithm>
#include <cmath>

namespace failures {
namespace {

constexpr int size = 16;
constexpr int threads = 4;

/// Sheets from back to front, at depths of 16 to 1. Only that at the back takes
/// long to shade.
template <class Sheet> std::vector<Sheet> makeSheets(int effort) {
  constexpr int count = 16;
  std::vector<Sheet> sheets;
  for (int i = 0; i < count; ++i)
    sheets.push_back({float(count - i), i == 0 ? effort : 16});
  return sheets;
}

using Colors = std::vector<float>;

Colors drawApart(int effort) {
  auto sheets = makeSheets<pipelines::ColorsApart::Sheet>(effort);
  Colors colors(size * size);
  std::vector<uint32_t> depths(size * size, 0x7f800000); // infinity
  pipelines::ColorsApart pipe;
  pipe.setDomain({size, size});
  pipe.setThreads(threads);
  pipe.state().depths.bind(depths);
  pipe.state().colors.bind(colors);
  pipe.feed(pipe.apart, sheets);
  pipe.run().orThrow();
  return colors;
}

Colors drawTogether(int effort) {
  auto sheets = makeSheets<pipelines::ColorsTogether::Sheet>(effort);
  pipelines::ColorsTogether pipe;
  pipe.setDomain({size, size});
  pipe.setThreads(threads);
  pipe.feed(pipe.shade, sheets);
  pipe.run().orThrow();
  auto image = pipe.state().together.view();
  Colors colors;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      colors.push_back(image(x, y).color);
  return colors;
}

/// The nearest sheet's colour is about 1.
double percentWrong(const Colors &colors) {
  double wrong = 0;
  for (float color : colors)
    wrong += std::abs(color - 1) > 0.1f;
  return 100 * wrong / double(colors.size());
}

/// A tile for each of several runs.
template <class Run> Image show(Run run) {
  constexpr int runs = 8; // a side
  std::vector<Colors> tiles;
  for (int i = 0; i < runs * runs; ++i)
    tiles.push_back(run());
  return paint(runs * size, runs * size, [&](int x, int y) {
    float depth = tiles[y / size * runs + x / size][y % size * size + x % size];
    float far = std::min((depth - 1) / 15, 1.0f);
    return rgb(0.4f + 0.6f * far, 0.9f - 0.7f * far, 0.8f - 0.7f * far);
  });
}

struct RacingColors : Mode {
  static constexpr int rounds = 8;

  Description describe() const override {
    return {"RacingColors",
            "Threads between depth and colour",
            "steps of the first sheet's shader",
            "percent of pixels with another sheet's colour",
            "an atomic, then a store",
            "one update of both",
            {1e2, 1e3, 3e3, 1e4, 3e4, 1e5, 1e6}};
  }
  Errors measure(double effort) const override {
    Errors errors{};
    for (int i = 0; i < rounds; ++i) {
      errors.naive += percentWrong(drawApart(int(effort))) / rounds;
      errors.ours += percentWrong(drawTogether(int(effort))) / rounds;
    }
    return errors;
  }
  Pictures draw() const override {
    return {show([] { return drawApart(30000); }),
            show([] { return drawTogether(30000); })};
  }
};
const Registration<RacingColors> registration;

TEST(Failure, RacingColors) {
  Errors errors = RacingColors().measure(1e6);
  EXPECT_GT(errors.naive, 10);
  EXPECT_EQ(errors.ours, 0);
}

} // namespace
} // namespace failures
