// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- PrivateCopiesTest.cpp - Reductions without locks -------------------===//

#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace {

struct Item {
  int32_t value;
};
struct Pixel {
  int32_t other, least;
};
constexpr Pixel identity{0, INT32_MAX};
constexpr int32_t runShift = 6;

bool often;
/// Does what the kernel's units do; all of them are open.
std::function<void(const pikoir_state &, const std::vector<pikoir_private> &)>
    act;

void combine(uint8_t *to, uint8_t *copy, int64_t records) {
  auto *state = reinterpret_cast<Pixel *>(to);
  auto *pixels = reinterpret_cast<Pixel *>(copy);
  for (int64_t i = 0; i < records; ++i) {
    state[i].least = std::min(state[i].least, pixels[i].least);
    pixels[i].least = INT32_MAX;
  }
}

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Least", 2);
  pikoir_declare_record(p, 0, "Item", sizeof(Item), 4);
  pikoir_declare_field(p, 0, "value", PIKORT_I32, 0, 1, 0);
  pikoir_declare_record(p, 1, "Pixel", sizeof(Pixel), 4);
  pikoir_declare_field(p, 1, "other", PIKORT_I32, 0, 1, 0);
  pikoir_declare_field(p, 1, "least", PIKORT_I32, 4, 1, 0);
  constexpr Pixel clear{7, 100};
  pikoir_declare_state(p, 0, "image", PIKORT_IMAGE, 1, 2, -1, &clear);
  int64_t bins[] = {0, 0};
  pikoir_declare_stage(p, 0, "draw", 0, bins, PIKOIR_LOAD_BALANCE, 0,
                       PIKOIR_SPLIT | PIKOIR_WRITES, 0);
  pikoir_declare_source(p, 0, 0);
  pikoir_declare_private(p, 0, 0, 0, &identity, runShift, often, combine);
}

/// One thread has several units open at a time, so that each has a lane.
int32_t run(pikort_pipeline *p) {
  pikoir_clear(p, 0);
  const pikoir_input *in = pikoir_begin(p, 0);
  if (!in)
    return pikoir_status(p);
  for (int64_t u = 0; u < in->unit_count;) {
    std::vector<pikoir_writer *> writers;
    std::vector<pikoir_private> copies;
    for (int32_t i = 0; i < pikoir_threads(p) && u < in->unit_count; ++i) {
      writers.push_back(pikoir_open(p, 0, u++));
      copies.push_back(*pikoir_get_private(writers.back(), 0));
    }
    act(*pikoir_get_state(p, 0), copies);
    for (pikoir_writer *writer : writers)
      pikoir_close(writer);
  }
  return pikoir_end(p, 0);
}

class PrivateCopies : public testing::Test {
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
  /// The same; whether units had copies, or the state, without locks.
  bool isPrivate(int32_t threads, int64_t count) {
    bool all = true, none = true;
    act = [&](const pikoir_state &, const std::vector<pikoir_private> &copies) {
      for (const pikoir_private &copy : copies)
        (copy.data ? none : all) = false;
    };
    draw(threads, count);
    EXPECT_NE(all, none);
    return all;
  }

  std::vector<Item> items;
  piko::rt::Pipeline pipe{
      pikort_program{PIKORT_ABI_VERSION, "Least", setup, run}};
};

// Each unit that is open has its own, one of them the state. What they hold is
// in the state at the end, and gone from the copies in the next run.
TEST_F(PrivateCopies, Combined) {
  EXPECT_TRUE(pipe.domain({300, 3}));
  for (int round = 0; round < 3; ++round) {
    int states = 0;
    act = [&](const pikoir_state &state,
              const std::vector<pikoir_private> &copies) {
      ASSERT_GE(copies.size(), 1u);
      for (size_t i = 0; i < copies.size(); ++i) {
        auto *pixels = reinterpret_cast<Pixel *>(copies[i].data);
        for (size_t j = 0; j < i; ++j)
          EXPECT_NE(copies[j].data, copies[i].data);
        states += copies[i].data == state.data;
        auto change = [&](int at, int value) {
          pixels[at].least = std::min(pixels[at].least, value);
          copies[i].dirty[at >> runShift] = 1;
        };
        change(0, 50 - int(i));
        change(899, 40 * round - int(i));
        change(400 + int(i), 5);
      }
    };
    draw(3, 4000);
    auto image = pipe.view<Pixel>("image");
    EXPECT_EQ(image(0, 0).least, 48);
    EXPECT_EQ(image(299, 2).least, 40 * round - 2);
    EXPECT_GT(states, 0);
    for (int i = 0; i < 3; ++i)
      EXPECT_EQ(image(100 + i, 1).least, 5);
    for (int i : {1, 99, 103, 299})
      EXPECT_EQ(image(i, 1).least, 100);
    EXPECT_EQ(image(0, 0).other, 7);
  }
}

// One thread has the state itself.
TEST_F(PrivateCopies, OneThread) {
  EXPECT_TRUE(pipe.domain({3000, 2000}));
  act = [&](const pikoir_state &state,
            const std::vector<pikoir_private> &copies) {
    EXPECT_EQ(copies[0].data, state.data);
  };
  draw(1, 40);
}

// They are not for few primitives, large state, many threads and little memory.
TEST_F(PrivateCopies, WhereTheyPay) {
  EXPECT_TRUE(pipe.domain({640, 100})); // 1,000 runs
  EXPECT_FALSE(isPrivate(2, 3999));
  EXPECT_TRUE(isPrivate(2, 4000));
  EXPECT_TRUE(isPrivate(8, 20000));
  EXPECT_FALSE(isPrivate(9, 20000));
  EXPECT_TRUE(pipe.memoryLimit(1 << 30));
  EXPECT_FALSE(isPrivate(2, 4000));
  EXPECT_TRUE(pipe.memoryLimit(0));
  EXPECT_TRUE(isPrivate(2, 4000));
  EXPECT_TRUE(pipe.domain({640, 10}));
  EXPECT_TRUE(isPrivate(2, 400));
  EXPECT_TRUE(pipe.domain({4096, 2049})); // more than 64 MiB
  EXPECT_FALSE(isPrivate(2, 4'000'000));
}

TEST_F(PrivateCopies, ManyChanges) {
  often = true;
  piko::rt::Pipeline other({PIKORT_ABI_VERSION, "Least", setup, run});
  std::swap(pipe, other);
  EXPECT_TRUE(pipe.domain({640, 100}));
  EXPECT_FALSE(isPrivate(2, 249));
  EXPECT_TRUE(isPrivate(2, 250));
}

TEST_F(PrivateCopies, Declarations) {
  auto expect = [](void (*wrong)(pikort_pipeline *), const char *message) {
    piko::rt::Pipeline other({PIKORT_ABI_VERSION, "Least", wrong, run});
    EXPECT_EQ(other.created().code(), PIKORT_BAD_PROGRAM);
    EXPECT_EQ(other.created().message(), message);
  };
  expect(
      [](pikort_pipeline *p) {
        setup(p);
        pikoir_declare_private(p, 0, 1, 3, &identity, 0, 0, combine);
      },
      "private copy 1: expected a declared buffer or image, but got state 3");
  expect(
      [](pikort_pipeline *p) {
        setup(p);
        pikoir_declare_private(p, 0, 1, 0, &identity, 0, 0, nullptr);
      },
      "private copy 1: expected an identity, a function, and a shift in "
      "[0, 31]");
  expect(
      [](pikort_pipeline *p) {
        setup(p);
        pikoir_declare_private(p, 0, 0, 0, &identity, 0, 0, combine);
      },
      "expected private copy 0 to be declared once");
}

} // namespace
