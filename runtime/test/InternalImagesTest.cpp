// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- InternalImagesTest.cpp - Images that the host does not see ---------===//

#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>

namespace {

constexpr int64_t none = -1;
int64_t sum; ///< Of the pixels that the kernels' own image began with.

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Internal", 2);
  pikoir_declare_record(p, 0, "Word", 8, 8);
  pikoir_declare_field(p, 0, "word", PIKORT_I64, 0, 1, 0);
  pikoir_declare_state(p, 0, "shown", PIKORT_IMAGE, 0, 2, -1, nullptr);
  pikoir_declare_state(p, 1, "shown.first", PIKORT_IMAGE, 0, 2, -1, &none);
  pikoir_declare_internal(p, 1);
  int64_t bins[] = {0, 0};
  pikoir_declare_stage(p, 0, "draw", 0, bins, PIKOIR_LOAD_BALANCE, 0,
                       PIKOIR_SPLIT, 0);
  pikoir_declare_source(p, 0, 0);
}

int32_t run(pikort_pipeline *p) {
  pikoir_clear(p, 0);
  pikoir_clear(p, 1);
  const pikoir_state *own = pikoir_get_state(p, 1);
  auto *words = reinterpret_cast<int64_t *>(own->data);
  sum = 0;
  for (int64_t i = 0; i < own->extent[0] * own->extent[1]; ++i)
    sum += std::exchange(words[i], 7);
  return pikoir_status(p);
}

// It is as large as the domain and cleared, but nothing that describes the
// pipeline names it.
TEST(InternalImages, Hidden) {
  piko::rt::Pipeline pipe({PIKORT_ABI_VERSION, "Internal", setup, run});
  std::vector<int64_t> items{0};
  EXPECT_TRUE(pipe.source(0, items));
  for (int64_t width : {5, 9}) {
    EXPECT_TRUE(pipe.domain({width, 3}));
    for (int turn = 0; turn < 2; ++turn) {
      EXPECT_TRUE(pipe.run());
      EXPECT_EQ(sum, -3 * width);
    }
  }
  pikort_pipeline *p = pipe.get();
  EXPECT_EQ(pikort_state_count(p), 1);
  pikort_state_info info;
  EXPECT_EQ(pikort_get_state_info(p, 0, &info), PIKORT_OK);
  EXPECT_STREQ(info.name, "shown");
  EXPECT_EQ(pikort_get_state_info(p, 1, &info), PIKORT_NOT_FOUND);
  pikort_view view;
  EXPECT_EQ(pikort_get_view(p, "shown", &view), PIKORT_OK);
  EXPECT_EQ(pikort_get_view(p, "shown.first", &view), PIKORT_NOT_FOUND);
  EXPECT_STREQ(pikort_message(p),
               "pipeline 'Internal' has no state 'shown.first'");
}

TEST(InternalImages, Declaration) {
  piko::rt::Pipeline pipe({PIKORT_ABI_VERSION, "Internal",
                           [](pikort_pipeline *p) {
                             setup(p);
                             pikoir_declare_internal(p, 2);
                           },
                           run});
  EXPECT_EQ(pipe.created().code(), PIKORT_BAD_PROGRAM);
  EXPECT_EQ(pipe.created().message(),
            "expected the number of an image, but got 2");
}

} // namespace
