// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ClearsTest.cpp - Images that kernels clear
//--------------------------===//

#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>

namespace {

enum class Act { Run, FailBefore };
Act act;
bool takesLists, everyBin;
int launches; ///< Of the kernel, in a run.

struct Item {
  int32_t bin;
};
struct Pixel {
  int16_t tag;
  int16_t value;
};
constexpr Pixel clearValue{3, -5};

// Primitives in 4x4 bins of a 9x6 domain: three bins in a row, the last one a
// column wide, and two rows of them.
void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Clears", 2);
  pikoir_declare_record(p, 0, "Item", sizeof(Item), 4);
  pikoir_declare_field(p, 0, "bin", PIKORT_I32, 0, 1, 0);
  pikoir_declare_record(p, 1, "Pixel", sizeof(Pixel), 2);
  pikoir_declare_field(p, 1, "tag", PIKORT_I16, 0, 1, 0);
  pikoir_declare_field(p, 1, "value", PIKORT_I16, 2, 1, 0);
  pikoir_declare_state(p, 0, "image", PIKORT_IMAGE, 1, 2, -1, &clearValue);
  int64_t bins[] = {4, 4};
  pikoir_declare_stage(
      p, 0, "draw", 0, bins, PIKOIR_LOAD_BALANCE, 0,
      PIKOIR_PLACED | PIKOIR_ORDERED | (takesLists ? PIKOIR_LIST : 0), 0);
  if (takesLists)
    pikoir_declare_schedule(p, 0, 0, everyBin);
  pikoir_declare_source(p, 0, 0);
  pikoir_declare_clears(p, 0, 0);
}

/// What comes into the image must be seen: no bin but those that the kernel
/// has.
int32_t run(pikort_pipeline *p) {
  auto *pixels = reinterpret_cast<Pixel *>(pikoir_get_state(p, 0)->data);
  for (int i = 0; i < 54; ++i)
    pixels[i] = {77, 77};
  if (act == Act::FailBefore)
    pikoir_fail(p, 0, nullptr, -1, PIKORT_UPDATE_OUTSIDE, 0, 0);
  for (int launch = 0; launch < launches; ++launch) {
    const pikoir_input *in = pikoir_begin_source(p, 0);
    if (!in)
      return pikoir_status(p);
    for (int64_t u = 0; u < in->unit_count; ++u) {
      pikoir_writer *w = pikoir_open_source(p, 0, u);
      for (int64_t i = in->units[u].begin; i < in->units[u].end; ++i) {
        pikoir_place_source(w,
                            reinterpret_cast<const Item *>(in->items)[i].bin);
        pikoir_next(w);
      }
      pikoir_close(w);
    }
    pikoir_end_source(p, 0);
    in = pikoir_begin(p, 0);
    if (!in)
      return pikoir_status(p);
    EXPECT_EQ(in->clears, launch == 0);
    for (int64_t u = 0; u < in->unit_count; ++u) {
      pikoir_writer *w = pikoir_open(p, 0, u);
      for (int64_t i = takesLists ? in->units[u].bucket_begin
                                  : in->units[u].begin;
           i < (takesLists ? in->units[u].bucket_end : in->units[u].end); ++i)
        pikoir_next(w);
      pikoir_close(w);
    }
    if (int32_t status = pikoir_end(p, 0))
      return status;
  }
  return pikoir_status(p);
}

/// Runs with primitives in some bins; the bins, as bits, whose pixels are
/// clear.
int clearBins(std::vector<Item> items, int32_t status = PIKORT_OK) {
  piko::rt::Pipeline pipe({PIKORT_ABI_VERSION, "Clears", setup, run});
  EXPECT_TRUE(pipe.created()) << pipe.created().message();
  EXPECT_TRUE(pipe.domain({9, 6}));
  EXPECT_TRUE(pipe.source(0, items));
  int clear = 0;
  for (int threads : {1, 2, 7}) {
    pikort_set_threads(pipe.get(), threads);
    EXPECT_EQ(pipe.run().code(), status);
    auto image = pipe.view<Pixel>("image");
    clear = 63;
    for (int y = 0; y < 6; ++y)
      for (int x = 0; x < 9; ++x) {
        Pixel pixel = image(x, y);
        bool isClear = pixel.tag == clearValue.tag;
        EXPECT_EQ(pixel.value, isClear ? clearValue.value : 77);
        if (!isClear)
          clear &= ~(1 << (y / 4 * 3 + x / 4));
      }
  }
  return clear;
}

class Clears : public testing::Test {
protected:
  void SetUp() override {
    act = Act::Run;
    takesLists = everyBin = false;
    launches = 1;
  }
};

// What the kernel runs for is left to it, in its first launch.
TEST_F(Clears, BinsWithoutPrimitives) {
  EXPECT_EQ(clearBins({{1}, {5}, {1}}), 0b011101);
  EXPECT_EQ(clearBins({}), 0b111111);
  EXPECT_EQ(clearBins({{0}, {1}, {2}, {3}, {4}, {5}}), 0);
  launches = 3;
  EXPECT_EQ(clearBins({{3}}), 0b110111);
}

TEST_F(Clears, BinsWithoutCalls) {
  takesLists = true;
  EXPECT_EQ(clearBins({{1}, {5}, {1}}), 0b011101);
  everyBin = true;
  EXPECT_EQ(clearBins({{1}, {5}, {1}}), 0);
}

// A run that ends before the kernel does leaves the image as if it were clear.
TEST_F(Clears, WithoutTheKernel) {
  act = Act::FailBefore;
  EXPECT_EQ(clearBins({{1}}, PIKORT_UPDATE_OUTSIDE), 0b111111);
}

TEST_F(Clears, ImagesAlone) {
  piko::rt::Pipeline pipe({PIKORT_ABI_VERSION, "Clears",
                           [](pikort_pipeline *p) {
                             setup(p);
                             pikoir_declare_clears(p, 0, 4);
                           },
                           run});
  EXPECT_EQ(pipe.created().code(), PIKORT_BAD_PROGRAM);
  EXPECT_EQ(pipe.created().message(),
            "stage 'draw': expected an image to clear, and bins that are not "
            "split, but got state 4");
}

} // namespace
