// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CountersTest.cpp - Counters, and what a program is fixed to --------===//

#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>
#include <omp.h>
#include <string>

namespace {

struct Light {
  float x, y, z;
  int32_t kind;
};

bool wrong = false; ///< Whether setup declares a counter that makes no sense.
int64_t fixedSize = 3;

// 1000 accesses of 16 threads to the first 3 of 4 lights.
void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Counting", 1);
  pikoir_declare_record(p, 0, "Light", sizeof(Light), 4);
  pikoir_declare_field(p, 0, "x", PIKORT_F32, 0, 1, 0);
  pikoir_declare_field(p, 0, "kind", PIKORT_I32, 12, 1, 0);
  pikoir_declare_state(p, 0, "settings", PIKORT_CONSTANT, 0, 0, -1, nullptr);
  pikoir_declare_state(p, 1, "lights", PIKORT_BUFFER, 0, 1, -1, nullptr);
  int64_t bins[] = {0};
  pikoir_declare_stage(p, 0, "shade", 0, bins, PIKOIR_LOAD_BALANCE, 0, 0, 1);
  pikoir_declare_source(p, 0, 0);
  pikoir_declare_fixed(p, 0, "kind", 12, 4, 7);
  pikoir_declare_fixed(p, 1, "", 0, 0, fixedSize);
  pikoir_declare_counter(p, 0, PIKORT_CALLS, "shade", -1, -1, "shade.cpp:3");
  pikoir_declare_counter(p, 1, PIKORT_READS, "shade", 1, 0, nullptr);
  if (wrong)
    pikoir_declare_counter(p, 2, PIKORT_READS, "shade", 2, -1, nullptr);
}

int32_t run(pikort_pipeline *p) {
#pragma omp parallel for num_threads(16)
  for (int64_t i = 0; i < 1000; ++i) {
    pikoir_count(p, 0, 2);
    pikoir_count_element(p, 1, i % 3, 0, 0, 0, 4, i % 2 * 8);
  }
  pikoir_count(p, 9, 1); // there is none
  pikoir_count_element(p, 1, 77, 0, 0, 0, 4, 0);
  return PIKORT_OK;
}

const pikort_program program{PIKORT_ABI_VERSION, "Counting", setup, run};

struct Counting : testing::Test {
  Counting() {
    wrong = false;
    fixedSize = 4;
  }
  ~Counting() override { pikort_destroy(pipeline); }
  /// The status of a run with settings of a kind.
  int32_t start(int32_t kind) {
    pikort_destroy(pipeline);
    pipeline = nullptr;
    if (int32_t status = pikort_create(&program, &pipeline))
      return status;
    int64_t extent[] = {1};
    pikort_set_domain(pipeline, 1, extent);
    Light settings{0, 0, 0, kind};
    pikort_bind_constant(pipeline, "settings", &settings, sizeof settings);
    pikort_bind_buffer(pipeline, "lights", lights, 4, sizeof(Light));
    pikort_bind_source(pipeline, 0, lights, 4, sizeof(Light));
    return pikort_run(pipeline);
  }
  Light lights[4] = {};
  pikort_pipeline *pipeline = nullptr;
};

} // namespace

TEST_F(Counting, AddsUp) {
  ASSERT_EQ(start(7), PIKORT_OK) << pikort_message(pipeline);
  ASSERT_EQ(pikort_counter_count(pipeline), 2);
  pikort_counter counter;
  ASSERT_EQ(pikort_get_counter(pipeline, 0, &counter), PIKORT_OK);
  EXPECT_STREQ(counter.stage, "shade");
  EXPECT_STREQ(counter.place, "shade.cpp:3");
  EXPECT_EQ(counter.state, nullptr);
  EXPECT_EQ(counter.count, 2000);
  EXPECT_EQ(counter.around, -1);
  ASSERT_EQ(pikort_get_counter(pipeline, 1, &counter), PIKORT_OK);
  EXPECT_STREQ(counter.state, "lights");
  EXPECT_EQ(counter.place, nullptr);
  EXPECT_EQ(counter.around, 0);
  EXPECT_EQ(counter.count, 1001);
  EXPECT_EQ(counter.bytes, 4004);
  EXPECT_EQ(counter.distinct, 3);
  EXPECT_EQ(counter.distinct_bytes, 24); // x and z of each
}

TEST_F(Counting, IsReset) {
  ASSERT_EQ(start(7), PIKORT_OK);
  pikort_reset_stats(pipeline);
  pikort_counter counter;
  ASSERT_EQ(pikort_get_counter(pipeline, 1, &counter), PIKORT_OK);
  EXPECT_EQ(counter.count, 0);
  EXPECT_EQ(counter.distinct, 0);
}

TEST_F(Counting, SaysWhatIsWrong) {
  ASSERT_EQ(start(7), PIKORT_OK);
  pikort_counter counter;
  EXPECT_EQ(pikort_get_counter(pipeline, 2, &counter), PIKORT_NOT_FOUND);
  EXPECT_STREQ(pikort_message(pipeline),
               "pipeline 'Counting' has no counter 2");
  EXPECT_EQ(pikort_get_counter(pipeline, 0, nullptr), PIKORT_INVALID_ARGUMENT);
  EXPECT_EQ(pikort_counter_count(nullptr), 0);
  wrong = true;
  EXPECT_EQ(start(7), PIKORT_BAD_PROGRAM);
  EXPECT_STREQ(pikort_message(pipeline), "counter 2 makes no sense");
}

// A program that was compiled for other values does not run.
TEST_F(Counting, IsFixed) {
  EXPECT_EQ(start(8), PIKORT_INVALID_ARGUMENT);
  EXPECT_STREQ(
      pikort_message(pipeline),
      "pipeline 'Counting': constant 'settings', field 'kind': expected "
      "7, which the pipeline was compiled for, but got 8");
  fixedSize = 5;
  EXPECT_EQ(start(7), PIKORT_INVALID_ARGUMENT);
  EXPECT_STREQ(pikort_message(pipeline),
               "pipeline 'Counting': buffer 'lights', size: expected 5, which "
               "the pipeline was compiled for, but got 4");
}
