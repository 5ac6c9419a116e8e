//===- HistogramTest.cpp - Histogram equalization under the reference -----===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "histogram/histogram.piko.cpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace {

using namespace histogram;

TEST(Histogram, EqualsALoopOverAllPixels) {
  constexpr int width = 37, height = 21, levels = 100;
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> value(0, 1);
  std::vector<Pixel> pixels;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      float root = value(generator);
      pixels.push_back({{x, y}, root * root});
    }

  std::vector<uint32_t> counts(levels), below(levels);
  Equalize pipe;
  pipe.setDomain({width, height});
  pipe.state().histogram.bind(counts.data(), levels);
  pipe.state().below.bind(below.data(), levels);
  pipe.feed(pipe.count, pixels);
  pipe.run();

  for (const Pixel &pixel : pixels) {
    int lower = 0;
    for (const Pixel &other : pixels)
      lower += int(other.gray * levels) < int(pixel.gray * levels);
    EXPECT_EQ(pipe.state().output(pixel.at),
              float(lower) / float(pixels.size()));
  }
}

// What is outside the domain counts, but leaves no pixel.
TEST(Histogram, ClampsLevelsAndCullsPixels) {
  std::vector<uint32_t> counts(4), below(4);
  std::vector<Pixel> pixels{{{0, 0}, -3}, {{1, 0}, 1}, {{5, 5}, 0.3f}};
  Equalize pipe;
  pipe.setDomain({2, 1});
  pipe.state().histogram.bind(counts.data(), 4);
  pipe.state().below.bind(below.data(), 4);
  pipe.feed(pipe.count, pixels);
  pipe.run();
  EXPECT_EQ(counts, (std::vector<uint32_t>{1, 1, 0, 1}));
  EXPECT_EQ(below, (std::vector<uint32_t>{0, 1, 2, 2}));
  EXPECT_EQ(pipe.state().output({1, 0}), 2.0f / 3);
}

} // namespace
