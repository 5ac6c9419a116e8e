// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- PrivateImagesTest.cpp - Pixels that threads select -----------------===//

#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace {

struct Item {
  int32_t value;
};
struct Depth {
  int32_t least;
};
struct Color {
  int32_t shown, other;
};

bool often;

/// What a unit sees.
struct View {
  int64_t unit;
  Depth *depth;
  Color *color;
  int32_t *units;
  void select(int64_t pixel, int32_t depth, int32_t shown) const {
    if (depth >= this->depth[pixel].least)
      return;
    this->depth[pixel].least = depth;
    color[pixel].shown = shown;
    if (units)
      units[pixel] = static_cast<int32_t>(unit);
  }
};
/// Does what the kernel's units do; all of them are open.
std::function<void(const std::vector<View> &)> act;

View viewOf(uint8_t *const *images, int64_t unit) {
  return {unit, reinterpret_cast<Depth *>(images[0]),
          reinterpret_cast<Color *>(images[1]),
          reinterpret_cast<int32_t *>(images[2])};
}

void select(uint8_t *const *to, uint8_t *const *from, int64_t begin,
            int64_t end) {
  View mine = viewOf(to, 0), other = viewOf(from, 0);
  for (int64_t i = begin; i < end; ++i) {
    if (other.units[i] == -1)
      continue;
    int32_t was = mine.units[i];
    if (was == -1 || other.depth[i].least < mine.depth[i].least ||
        (other.depth[i].least == mine.depth[i].least && other.units[i] < was)) {
      mine.depth[i] = other.depth[i];
      mine.color[i].shown = other.color[i].shown;
      mine.units[i] = other.units[i];
    }
  }
}

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Nearest", 2);
  pikoir_declare_record(p, 0, "Item", sizeof(Item), 4);
  pikoir_declare_field(p, 0, "value", PIKORT_I32, 0, 1, 0);
  pikoir_declare_record(p, 1, "Depth", sizeof(Depth), 4);
  pikoir_declare_field(p, 1, "least", PIKORT_I32, 0, 1, 0);
  pikoir_declare_record(p, 2, "Color", sizeof(Color), 4);
  pikoir_declare_field(p, 2, "shown", PIKORT_I32, 0, 1, 0);
  pikoir_declare_field(p, 2, "other", PIKORT_I32, 4, 1, 0);
  constexpr Depth far{100};
  constexpr Color clear{1, 7};
  pikoir_declare_state(p, 0, "depth", PIKORT_IMAGE, 1, 2, -1, &far);
  pikoir_declare_state(p, 1, "color", PIKORT_IMAGE, 2, 2, -1, &clear);
  int64_t bins[] = {0, 0};
  pikoir_declare_stage(p, 0, "draw", 0, bins, PIKOIR_DIRECT_MAP, 0,
                       PIKOIR_SPLIT | PIKOIR_ORDERED | PIKOIR_WRITES, 0);
  pikoir_declare_source(p, 0, 0);
  int32_t images[] = {0, 1};
  pikoir_declare_selection(p, 0, 0, images, 2, often, select);
}

/// One thread has several units open at a time, so that each has a lane.
int32_t run(pikort_pipeline *p) {
  pikoir_clear(p, 0);
  pikoir_clear(p, 1);
  const pikoir_input *in = pikoir_begin(p, 0);
  if (!in)
    return pikoir_status(p);
  for (int64_t u = 0; u < in->unit_count;) {
    std::vector<pikoir_writer *> writers;
    std::vector<View> views;
    for (int32_t i = 0; i < pikoir_threads(p) && u < in->unit_count; ++i, ++u) {
      writers.push_back(pikoir_open(p, 0, u));
      views.push_back(viewOf(pikoir_get_images(writers.back(), 0), u));
    }
    act(views);
    for (pikoir_writer *writer : writers)
      pikoir_close(writer);
  }
  return pikoir_end(p, 0);
}

class PrivateImages : public testing::Test {
protected:
  void SetUp() override { often = false; }

  /// Runs with so many primitives.
  void draw(int32_t threads, int64_t count) {
    items.resize(static_cast<size_t>(count));
    EXPECT_TRUE(pipe.source(0, items));
    EXPECT_TRUE(pipe.threads(threads));
    auto status = pipe.run();
    EXPECT_TRUE(status) << status.message();
  }
  /// The same; how many units are open at a time, if they have own images.
  size_t countShared(int32_t threads, int64_t count) {
    size_t shared = 0;
    bool none = true;
    act = [&](const std::vector<View> &views) {
      for (const View &view : views)
        none &= !view.units;
      shared = std::max(shared, views.size());
    };
    draw(threads, count);
    return none ? 0 : shared;
  }

  std::vector<Item> items;
  piko::rt::Pipeline pipe{
      pikort_program{PIKORT_ABI_VERSION, "Nearest", setup, run}};
};

// Each unit that is open has its own, one of them the state; what is first is
// in the state at the end, and nothing of it in the next run.
TEST_F(PrivateImages, Combined) {
  EXPECT_TRUE(pipe.domain({300, 300}));
  for (int round = 0; round < 3; ++round) {
    act = [&](const std::vector<View> &views) {
      for (const View &view : views) {
        auto unit = static_cast<int32_t>(view.unit);
        view.select(0, 50 - unit % 2, unit);    // equal ones of several
        view.select(1, 90 - unit, 1000 + unit); // the last is the least
        view.select(2, 20, unit);
        view.select(3, 100, unit); // not before what was there
        if (unit == 2)
          view.select(89'999, round, 3 * round);
      }
    };
    draw(3, 40'000);
    auto depth = pipe.view<Depth>("depth");
    auto color = pipe.view<Color>("color");
    EXPECT_EQ(depth(0, 0).least, 49);
    EXPECT_EQ(color(0, 0).shown, 1);
    EXPECT_EQ(depth(1, 0).least, 91 - (color(1, 0).shown - 999));
    EXPECT_GT(color(1, 0).shown, 1002);
    EXPECT_EQ(color(2, 0).shown, 0);
    EXPECT_EQ(depth(3, 0).least, 100);
    EXPECT_EQ(color(3, 0).shown, 1);
    EXPECT_EQ(color(299, 299).shown, 3 * round);
    EXPECT_EQ(depth(299, 299).least, round);
    EXPECT_EQ(color(5, 5).shown, 1);
    EXPECT_EQ(color(0, 0).other, 7);
  }
}

// They are not for one thread, few primitives and little memory.
TEST_F(PrivateImages, WhereTheyPay) {
  EXPECT_TRUE(pipe.domain({640, 100}));
  EXPECT_EQ(countShared(1, 40'000), 0u);
  EXPECT_EQ(countShared(2, 15'999), 0u);
  EXPECT_EQ(countShared(2, 16'000), 2u);
  EXPECT_TRUE(pipe.memoryLimit(1 << 30));
  EXPECT_EQ(countShared(2, 16'000), 0u);
  EXPECT_TRUE(pipe.memoryLimit(0));
  EXPECT_EQ(countShared(2, 16'000), 2u);
  EXPECT_TRUE(pipe.domain({640, 10}));
  EXPECT_EQ(countShared(2, 1'600), 2u);
}

TEST_F(PrivateImages, ManyPixels) {
  often = true;
  piko::rt::Pipeline other({PIKORT_ABI_VERSION, "Nearest", setup, run});
  std::swap(pipe, other);
  EXPECT_TRUE(pipe.domain({640, 100}));
  EXPECT_EQ(countShared(2, 999), 0u);
  EXPECT_EQ(countShared(2, 1'000), 2u);
}

// As many threads have some as memory suffices for: 512 MiB.
TEST_F(PrivateImages, LargePixels) {
  often = true;
  piko::rt::Pipeline other({PIKORT_ABI_VERSION, "Nearest", setup, run});
  std::swap(pipe, other);
  constexpr int32_t width = 4096, height = 3000; // 188 MiB each
  EXPECT_TRUE(pipe.domain({width, height}));
  EXPECT_EQ(countShared(4, int64_t(width) * height / 64), 2u);
  EXPECT_TRUE(pipe.domain({width, 2 * height}));
  EXPECT_EQ(countShared(4, int64_t(width) * height / 32), 0u);
}

TEST_F(PrivateImages, Declarations) {
  auto expect = [](void (*wrong)(pikort_pipeline *), const char *message) {
    piko::rt::Pipeline other({PIKORT_ABI_VERSION, "Nearest", wrong, run});
    EXPECT_EQ(other.created().code(), PIKORT_BAD_PROGRAM);
    EXPECT_EQ(other.created().message(), message);
  };
  static const int32_t missing[] = {0, 5};
  expect(
      [](pikort_pipeline *p) {
        setup(p);
        pikoir_declare_selection(p, 0, 1, missing, 2, 0, select);
      },
      "selection 1: expected a declared image, but got state 5");
  expect(
      [](pikort_pipeline *p) {
        setup(p);
        pikoir_declare_selection(p, 0, 1, missing, 0, 0, select);
      },
      "selection 1: expected images and a function");
  expect(
      [](pikort_pipeline *p) {
        setup(p);
        pikoir_declare_selection(p, 0, 0, missing, 1, 0, select);
      },
      "expected selection 0 to be declared once");
}

} // namespace
