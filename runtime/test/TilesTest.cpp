// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- TilesTest.cpp - Copies of a bin's pixels ---------------------------===//

#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace {

struct Item {
  int32_t value;
};
struct Pixel {
  int64_t value;
};

std::function<void(pikort_pipeline *, pikoir_writer *)> act;

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Tiles", 2);
  pikoir_declare_record(p, 0, "Item", sizeof(Item), 4);
  pikoir_declare_field(p, 0, "value", PIKORT_I32, 0, 1, 0);
  pikoir_declare_record(p, 1, "Pixel", sizeof(Pixel), 8);
  pikoir_declare_field(p, 1, "value", PIKORT_I64, 0, 1, 0);
  constexpr Pixel clear{5};
  pikoir_declare_state(p, 0, "pixels", PIKORT_IMAGE, 1, 2, -1, &clear);
  int64_t bins[] = {64, 64};
  pikoir_declare_stage(p, 0, "draw", 0, bins, PIKOIR_DIRECT_MAP, 0,
                       PIKOIR_WRITES, 0);
  pikoir_declare_state(p, 1, "others", PIKORT_IMAGE, 1, 2, -1, &clear);
  pikoir_declare_source(p, 0, 0);
}

int32_t run(pikort_pipeline *p) {
  pikoir_clear(p, 0);
  pikoir_clear(p, 1);
  const pikoir_input *in = pikoir_begin(p, 0);
  if (!in)
    return pikoir_status(p);
  for (int64_t u = 0; u < in->unit_count; ++u) {
    pikoir_writer *w = pikoir_open(p, 0, u);
    act(p, w);
    pikoir_close(w);
  }
  return pikoir_end(p, 0);
}

class Tiles : public testing::Test {
protected:
  /// Runs once with one primitive.
  void draw(int64_t width, int64_t height) {
    EXPECT_TRUE(pipe.domain({width, height}));
    EXPECT_TRUE(pipe.source(0, items));
    auto status = pipe.run();
    EXPECT_TRUE(status) << status.message();
  }
  /// From how many primitives on bins of an image of this size have copies.
  int64_t getLeast(int64_t width, int64_t height) {
    int64_t least = -1;
    act = [&](pikort_pipeline *p, pikoir_writer *) {
      least = pikoir_tile_least(p, 0, 0);
    };
    draw(width, height);
    return least;
  }

  std::vector<Item> items{{1}};
  piko::rt::Pipeline pipe{
      pikort_program{PIKORT_ABI_VERSION, "Tiles", setup, run}};
};

// Rows of 8 KiB are in one set; those of 8256 bytes in all. Few rows are in the
// cache wherever they are.
TEST_F(Tiles, PayWhereRowsCompete) {
  EXPECT_EQ(getLeast(1024, 128), 32);
  EXPECT_EQ(getLeast(1920, 128), 32);
  EXPECT_EQ(getLeast(1032, 128), INT64_MAX);
  EXPECT_EQ(getLeast(1024, 8), INT64_MAX);
}

// Pixels are where the address and the pitch say; what is written is in the
// image when the tile is closed, and no pixel of another bin.
TEST_F(Tiles, CopyABin) {
  act = [](pikort_pipeline *p, pikoir_writer *w) {
    const pikoir_state *image = pikoir_get_state(p, 0);
    auto *pixels = reinterpret_cast<Pixel *>(image->data);
    for (int64_t i = 0; i < 100 * 70; ++i)
      pixels[i].value = i;
    // The last bin is cut: 36 x 6 pixels.
    const pikoir_tile *tile = pikoir_open_tile(w, 0, 3);
    EXPECT_EQ(tile->pitch, 64);
    for (int64_t y = 64; y < 70; ++y)
      for (int64_t x = 64; x < 100; ++x) {
        auto &pixel = reinterpret_cast<Pixel *>(
            tile->data + (y * tile->pitch + x) * int64_t(sizeof(Pixel)))[0];
        EXPECT_EQ(pixel.value, y * 100 + x);
        pixel.value = -1;
        EXPECT_EQ(pixels[y * 100 + x].value, y * 100 + x);
      }
    pikoir_close_tile(w, 0);
    for (int64_t y = 0; y < 70; ++y)
      for (int64_t x = 0; x < 100; ++x)
        EXPECT_EQ(pixels[y * 100 + x].value,
                  x >= 64 && y >= 64 ? -1 : y * 100 + x);
  };
  draw(100, 70);
}

// A second tile takes the memory of the first.
TEST_F(Tiles, TakeTurns) {
  act = [](pikort_pipeline *p, pikoir_writer *w) {
    auto *pixels = reinterpret_cast<Pixel *>(pikoir_get_state(p, 0)->data);
    const pikoir_tile *tile = pikoir_open_tile(w, 0, 0);
    uint8_t *memory = tile->data;
    auto *first = reinterpret_cast<Pixel *>(memory);
    for (int64_t y = 0; y < 64; ++y)
      for (int64_t x = 0; x < 64; ++x)
        first[y * tile->pitch + x].value = x;
    pikoir_close_tile(w, 0);
    EXPECT_EQ(pixels[128 + 63].value, 63);
    EXPECT_EQ(pixels[128 + 64].value, 5);
    tile = pikoir_open_tile(w, 0, 1);
    EXPECT_EQ(tile->data, memory - 64 * int64_t(sizeof(Pixel)));
    EXPECT_EQ(first[0].value, 5);
    pikoir_close_tile(w, 0);
  };
  draw(128, 64);
}

// Two images at a time, and what no tile is closed of is left alone.
TEST_F(Tiles, OfTwoImages) {
  act = [](pikort_pipeline *p, pikoir_writer *w) {
    pikoir_close_tile(w, 0);
    const pikoir_tile *first = pikoir_open_tile(w, 0, 0);
    const pikoir_tile *second = pikoir_open_tile(w, 1, 0);
    reinterpret_cast<Pixel *>(first->data)[3].value = 6;
    reinterpret_cast<Pixel *>(second->data)[3].value = 7;
    pikoir_close_tile(w, 0);
    pikoir_close_tile(w, 1);
    for (int32_t image : {0, 1})
      EXPECT_EQ(
          reinterpret_cast<Pixel *>(pikoir_get_state(p, image)->data)[3].value,
          6 + image);
  };
  draw(128, 64);
}

// Where memory is refused it is the image that is changed.
TEST_F(Tiles, WithoutMemory) {
  int64_t before = -1, pitch = 0;
  act = [&](pikort_pipeline *p, pikoir_writer *w) {
    const pikoir_state *image = pikoir_get_state(p, 0);
    pikort_set_memory_limit(p, 1);
    const pikoir_tile *tile = pikoir_open_tile(w, 0, 1);
    before = tile->data - image->data;
    pitch = tile->pitch;
    reinterpret_cast<Pixel *>(tile->data)[64].value = 9;
    pikoir_close_tile(w, 0);
    pikort_set_memory_limit(p, 0);
    EXPECT_EQ(reinterpret_cast<Pixel *>(image->data)[64].value, 9);
  };
  draw(128, 64);
  EXPECT_EQ(before, 0);
  EXPECT_EQ(pitch, 128);
}

} // namespace
