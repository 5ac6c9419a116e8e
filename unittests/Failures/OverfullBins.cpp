//===- OverfullBins.cpp - All in one bin, one in all, none ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "FixedBins.h"
#include "FourBins.h"
#include "GrownBins.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace failures {
namespace {

constexpr int size = 128;
constexpr int bins = 64, boxesOfBin = 1024; // as in the pipelines

using Box = pipelines::GrownBins::Box;
/// How many boxes cover each pixel.
using Counts = std::vector<int64_t>;

/// So many of at most 4 x 4 pixels in bin (5, 3).
std::vector<Box> fillOneBin(int64_t count) {
  std::minstd_rand random(1);
  std::vector<Box> boxes(static_cast<size_t>(count));
  for (Box &b : boxes) {
    uint32_t bits = random();
    int x = 80 + bits % 13, y = 48 + bits / 13 % 13;
    b = {{x, y}, {x + bits / 169 % 4, y + bits / 676 % 4}};
  }
  return boxes;
}

/// A hundred of so many pixels a side.
std::vector<Box> makeLarge(int side) {
  std::minstd_rand random(1);
  std::vector<Box> boxes(100);
  for (Box &b : boxes) {
    int x = int(random() % (size + 1 - side)),
        y = int(random() % (size + 1 - side));
    b = {{x, y}, {x + side - 1, y + side - 1}};
  }
  return boxes;
}

template <class Pipe> Counts finish(Pipe &pipe, const std::vector<Box> &boxes) {
  pipe.setDomain({size, size});
  pipe.feed(0, static_cast<const void *>(boxes.data()), int64_t(boxes.size()));
  pipe.run().orThrow();
  auto image = pipe.state().image.view();
  Counts counts;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      counts.push_back(image(x, y).boxes);
  return counts;
}

Counts drawFixed(const std::vector<Box> &boxes) {
  pipelines::FixedBins pipe;
  pipe.state().counts.allocate(bins);
  pipe.state().members.allocate(bins * boxesOfBin);
  pipe.feed(1, static_cast<const void *>(nullptr), 0);
  return finish(pipe, boxes);
}

/// In strips that fit a budget, if there is one.
Counts drawGrown(const std::vector<Box> &boxes, int64_t budget = 0) {
  pipelines::GrownBins pipe;
  pipe.setMemoryBudget(budget);
  return finish(pipe, boxes);
}

Counts drawFour(const std::vector<Box> &boxes) {
  pipelines::FourBins pipe;
  return finish(pipe, boxes);
}

/// By sums over the differences at corners.
Counts findExact(const std::vector<Box> &boxes) {
  constexpr int row = size + 1;
  Counts sums(row * row);
  for (const Box &b : boxes) {
    ++sums[b.lo.y * row + b.lo.x];
    --sums[b.lo.y * row + b.hi.x + 1];
    --sums[(b.hi.y + 1) * row + b.lo.x];
    ++sums[(b.hi.y + 1) * row + b.hi.x + 1];
  }
  Counts counts;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      int64_t &here = sums[y * row + x];
      here += (x ? sums[y * row + x - 1] : 0) +
              (y ? sums[(y - 1) * row + x] : 0) -
              (x && y ? sums[(y - 1) * row + x - 1] : 0);
      counts.push_back(here);
    }
  return counts;
}

double percentWrong(const Counts &counts, const Counts &exact) {
  double wrong = 0, all = 0;
  for (size_t i = 0; i < exact.size(); ++i) {
    wrong += double(std::abs(counts[i] - exact[i]));
    all += double(exact[i]);
  }
  return 100 * wrong / std::max(all, 1.0);
}

Image show(const Counts &counts, const Counts &exact) {
  double most = double(*std::max_element(exact.begin(), exact.end()));
  return paint(size, size, [&](int x, int y) {
    float share = float(counts[y * size + x] / most);
    return rgb(share, share, 0.5f * share);
  });
}

struct OverfullBins : Mode {
  static constexpr int64_t budget = 64 << 20;

  Description describe() const override {
    return {"OverfullBins",
            "All boxes in one bin",
            "boxes",
            "percent of the boxes' pixels that are lost",
            "room for 1024 in each bin",
            "lists as long as they must be",
            {100, 1000, 2000, 1e4, 1e5, 1e6, 1e7}};
  }
  Errors measure(double count) const override {
    std::vector<Box> boxes = fillOneBin(int64_t(count));
    Counts exact = findExact(boxes);
    return {percentWrong(drawFixed(boxes), exact),
            percentWrong(drawGrown(boxes, budget), exact)};
  }
};
const Registration<OverfullBins> overfull;

struct LargeBoxes : Mode {
  Description describe() const override {
    return {"LargeBoxes",
            "Boxes in many bins",
            "pixels along a box; a bin has 16",
            "percent of the boxes' pixels that are lost",
            "room for four bins of a box",
            "as many bins as there are",
            {1, 8, 16, 17, 24, 32, 64, 128}};
  }
  Errors measure(double side) const override {
    std::vector<Box> boxes = makeLarge(int(side));
    Counts exact = findExact(boxes);
    return {percentWrong(drawFour(boxes), exact),
            percentWrong(drawGrown(boxes), exact)};
  }
  Pictures draw() const override {
    std::vector<Box> boxes = makeLarge(40);
    Counts exact = findExact(boxes);
    return {show(drawFour(boxes), exact), show(drawGrown(boxes), exact)};
  }
};
const Registration<LargeBoxes> large;

TEST(Failure, OverfullBins) {
  EXPECT_EQ(OverfullBins().measure(1000).naive, 0);
  Errors errors = OverfullBins().measure(1e6);
  EXPECT_GT(errors.naive, 90);
  EXPECT_EQ(errors.ours, 0);
}

TEST(Failure, OverfullBinsInLittleMemory) {
  // Bins of all boxes at once take 8 MB; strips need less.
  std::vector<Box> boxes = fillOneBin(1000000);
  pipelines::GrownBins pipe;
  pipe.setMemoryLimit(1 << 20);
  EXPECT_EQ(finish(pipe, boxes), findExact(boxes));
}

TEST(Failure, LargeBoxes) {
  EXPECT_EQ(LargeBoxes().measure(16).naive, 0);
  for (int side : {48, 128}) {
    Errors errors = LargeBoxes().measure(side);
    EXPECT_GT(errors.naive, 40) << side;
    EXPECT_EQ(errors.ours, 0) << side;
  }
}

TEST(Failure, EmptyBins) {
  std::vector<Box> none, one{{{0, 0}, {size - 1, size - 1}}};
  EXPECT_EQ(drawGrown(none), Counts(size * size, 0));
  EXPECT_EQ(drawGrown(one), Counts(size * size, 1));
}

} // namespace
} // namespace failures
