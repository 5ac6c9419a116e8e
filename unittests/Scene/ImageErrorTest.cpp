//===- ImageErrorTest.cpp - Differences between images --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/ImageError.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

using namespace piko::render;
using piko::scene::Color;

namespace {

Image fill(int width, int height, Color color) {
  return {width, height, std::vector<Color>(size_t(width) * height, color)};
}

constexpr Color black{{0, 0, 0, 1}}, white{{1, 1, 1, 1}}, green{{0, 1, 0, 1}},
    blue{{0, 0, 1, 1}};

TEST(ImageError, EqualImagesDoNotDiffer) {
  Image image = fill(7, 5, {{0.25f, 0.5f, 0.75f, 1}});
  auto error = compareImages(image, image);
  ASSERT_TRUE(error) << error.error().message;
  EXPECT_EQ(error->largest, 0);
  EXPECT_EQ(error->p99, 0);
  EXPECT_EQ(error->flip, 0);
  EXPECT_EQ(error->differing, 0);
  EXPECT_EQ(error->psnr, std::numeric_limits<double>::infinity());
}

// One channel of one pixel of 200 differs by a half.
TEST(ImageError, DifferencesOfOnePixel) {
  Image reference = fill(20, 10, black), image = reference;
  image.pixels[77].rgba.g = 0.5f;
  auto error = compareImages(reference, image);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->largest, 0.5);
  EXPECT_DOUBLE_EQ(error->mean, 0.5 / 600);
  EXPECT_DOUBLE_EQ(error->rms, std::sqrt(0.25 / 600));
  EXPECT_DOUBLE_EQ(error->psnr, -10 * std::log10(0.25 / 600));
  EXPECT_EQ(error->p99, 0);
  EXPECT_EQ(error->differing, 1);
  // Three of 200 are more than 1 %.
  image.pixels[3].rgba.r = image.pixels[4].rgba.b = 0.25f;
  EXPECT_EQ(compareImages(reference, image)->p99, 0.25);
}

TEST(ImageError, ComparesWhatIsShown) {
  Image reference = fill(4, 4, white), image = reference;
  image.pixels[0].rgba = {7, 1, std::numeric_limits<float>::infinity(), 1};
  image.pixels[1].rgba.r = std::numeric_limits<float>::quiet_NaN();
  auto error = compareImages(reference, image);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->notFinite, 2);
  EXPECT_EQ(error->differing, 2); // an infinity is black
  EXPECT_EQ(error->largest, 1);
}

/// Of images of one colour each, which have no edges.
double flipOf(Color a, Color b) {
  return compareImages(fill(9, 9, a), fill(9, 9, b))->flip;
}

// By definition, green and blue are as far apart as colours are; the others are
// of the paper's formulas, computed apart from this code.
TEST(Flip, ColorsFarApart) {
  EXPECT_NEAR(flipOf(green, blue), 1, 1e-6);
  EXPECT_NEAR(flipOf(blue, green), 1, 1e-6);
  EXPECT_NEAR(flipOf(black, white), 0.967379, 1e-5);
  EXPECT_NEAR(flipOf(black, {{0.5f, 0.5f, 0.5f, 1}}), 0.931485, 1e-5);
}

// A line that is missing shows where it is, up to the width of the filters.
TEST(Flip, ShowsFeatures) {
  Image flat = fill(64, 8, {{0.5f, 0.5f, 0.5f, 1}}), line = flat;
  for (int y = 0; y < 8; ++y)
    line.pixels[size_t(y) * 64 + 32].rgba = white.rgba;
  auto map = computeFlip(flat, line), back = computeFlip(line, flat);
  ASSERT_TRUE(map);
  EXPECT_EQ(*map, *back);
  for (int x = 0; x < 64; ++x) {
    float value = (*map)[size_t(3 * 64 + x)];
    if (int away = std::abs(x - 32); away <= 3 || away > 10)
      EXPECT_EQ(value > 0, away <= 3) << x;
    EXPECT_LE(value, (*map)[3 * 64 + 32]) << x;
  }
  EXPECT_GT((*map)[3 * 64 + 32], 0.3f);
}

// Far away, an eye does not see single pixels.
TEST(Flip, FallsWithDistance) {
  Image flat = fill(60, 60, {{0.5f, 0.5f, 0.5f, 1}}), noisy = flat;
  for (size_t i = 0; i < noisy.pixels.size(); ++i)
    noisy.pixels[i].rgba += i % 2 == 0 ? 0.05f : -0.05f;
  EXPECT_LT(compareImages(flat, noisy, 120)->flip,
            compareImages(flat, noisy, 20)->flip);
}

TEST(ImageError, IsTheSameWithoutFlip) {
  Image flat = fill(60, 40, {{0.5f, 0.5f, 0.5f, 1}}), other = flat;
  other.pixels[7].rgba = {0.75f, 0.5f, NAN, 1};
  auto all = compareImages(flat, other), colors = compareColors(flat, other);
  ASSERT_TRUE(all && colors);
  EXPECT_EQ(all->largest, colors->largest);
  EXPECT_EQ(all->mean, colors->mean);
  EXPECT_EQ(all->rms, colors->rms);
  EXPECT_EQ(all->p99, colors->p99);
  EXPECT_EQ(all->differing, colors->differing);
  EXPECT_EQ(all->notFinite, 1);
  EXPECT_EQ(colors->notFinite, 1);
  EXPECT_GT(all->flip, 0);
  EXPECT_EQ(colors->flip, 0);
  EXPECT_FALSE(compareColors(fill(3, 4, black), fill(4, 3, black)));
}

TEST(ImageError, Refuses) {
  EXPECT_FALSE(compareImages(fill(3, 4, black), fill(4, 3, black)));
  EXPECT_FALSE(compareImages(Image(), Image()));
  EXPECT_FALSE(compareImages(fill(3, 4, black), fill(3, 4, black), 0));
  EXPECT_FALSE(compareImages(fill(3, 4, black), fill(3, 4, black), NAN));
  // However coarse pixels are, FLIP is a number.
  EXPECT_EQ(compareImages(fill(3, 4, black), fill(3, 4, black), 0.01)->flip, 0);
}

} // namespace
