// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- EmulatorTest.cpp - Blocks, threads and warps emulated on the CPU
//----===//

#include "pikort/grid.h"
#include "pikort/pikort.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace {

// What the threads of a grid see; its blocks run one after the other.
struct Shared {
  std::vector<int> values, seen, blocks;
  int phase = 0;
};
Shared *shared = nullptr;
void (*body)() = nullptr;

void thread(const void *) { body(); }

int64_t blockCount = 1, threadCount = 32, seed = 0;

int32_t run(pikort_pipeline *p) {
  pikoir_grid_launch(p, thread, blockCount, threadCount, nullptr, seed);
  return pikoir_status(p);
}

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Grid", 1);
  pikoir_declare_record(p, 0, "F", 4, 4);
  pikoir_declare_field(p, 0, "x", PIKORT_I32, 0, 1, 0);
  int64_t bins[] = {0};
  pikoir_declare_stage(p, 0, "s", 0, bins, PIKOIR_LOAD_BALANCE, 0, 0, 0);
  pikoir_declare_source(p, 0, 0);
}

/// The error, or nothing.
std::string launch(Shared &state, int64_t blocks, int64_t threads,
                   int64_t order, void (*code)()) {
  shared = &state;
  body = code;
  blockCount = blocks;
  threadCount = threads;
  seed = order;
  state.values.resize(static_cast<size_t>(threads));
  state.seen.resize(static_cast<size_t>(threads));
  pikort_program program{PIKORT_ABI_VERSION, "Grid", setup, run};
  pikort_pipeline *p = nullptr;
  EXPECT_EQ(pikort_create(&program, &p), PIKORT_OK);
  int64_t extent[] = {8};
  pikort_set_domain(p, 1, extent);
  int32_t data = 0;
  pikort_bind_source(p, 0, &data, 1, sizeof(data));
  std::string error;
  if (pikort_run(p))
    error = pikort_message(p);
  pikort_destroy(p);
  return error;
}

} // namespace

// A thread sees at a barrier what those after it have written.
TEST(Emulator, Barrier) {
  Shared state;
  EXPECT_EQ(launch(state, 1, 64, 0,
                   [] {
                     int i = pikoir_gpu_thread(), n = pikoir_gpu_threads();
                     for (int round = 0; round < 3; ++round) {
                       shared->values[i] += i + round;
                       pikoir_gpu_barrier();
                       shared->seen[i] += shared->values[(i + 1) % n];
                       pikoir_gpu_barrier();
                     }
                   }),
            "");
  for (int i = 0; i < 64; ++i) {
    int next = (i + 1) % 64;
    EXPECT_EQ(state.seen[i], (next) + (2 * next + 1) + (3 * next + 3)) << i;
  }
}

// All threads get to know of one whose condition holds, in that round alone.
TEST(Emulator, BarrierOfConditions) {
  Shared state;
  EXPECT_EQ(launch(state, 1, 40, 0,
                   [] {
                     int i = pikoir_gpu_thread();
                     for (int round = 0; round < 4; ++round)
                       if (pikoir_gpu_barrier_or(0, i == 38 && round % 2 == 1))
                         shared->seen[i] += 1 << round;
                     pikoir_gpu_barrier();
                     shared->values[i] = pikoir_gpu_barrier_or(0, i >= 0) +
                                         2 * pikoir_gpu_barrier_or(0, i < 0);
                   }),
            "");
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(state.seen[i], 2 + 8) << i;
    EXPECT_EQ(state.values[i], 1) << i;
  }
}

TEST(Emulator, BarrierThatAThreadNeverReaches) {
  Shared state;
  EXPECT_EQ(launch(state, 4, 32, 0,
                   [] {
                     if (pikoir_gpu_block() < 2 || pikoir_gpu_thread() != 7)
                       pikoir_gpu_barrier();
                   }),
            "pipeline 'Grid': threads of block 2 wait for each other: 31 at a "
            "barrier, 0 for lanes of their warps, 1 have ended");
}

TEST(Emulator, ShuffleThatALaneNeverReaches) {
  Shared state;
  EXPECT_EQ(launch(state, 1, 40, 0,
                   [] {
                     if (pikoir_gpu_lane() != 3)
                       pikoir_gpu_shuffle(-1, 1, 0, 31);
                   }),
            "pipeline 'Grid': threads of block 0 wait for each other: 0 at a "
            "barrier, 38 for lanes of their warps, 2 have ended");
}

// Each warp by itself.
TEST(Emulator, Ballot) {
  Shared state;
  EXPECT_EQ(launch(state, 1, 64, 0,
                   [] {
                     int i = pikoir_gpu_thread();
                     shared->values[i] = pikoir_gpu_ballot(-1, i % 3 == 0);
                   }),
            "");
  uint32_t first = 0, second = 0;
  for (int lane = 0; lane < 32; ++lane) {
    first |= uint32_t(lane % 3 == 0) << lane;
    second |= uint32_t((lane + 32) % 3 == 0) << lane;
  }
  for (int i = 0; i < 64; ++i)
    EXPECT_EQ(uint32_t(state.values[i]), i < 32 ? first : second) << i;
}

// Lanes that take the same way are active together, and share a value.
TEST(Emulator, Active) {
  Shared state;
  EXPECT_EQ(launch(state, 1, 32, 0,
                   [] {
                     int i = pikoir_gpu_thread();
                     if (i % 2 == 0)
                       return;
                     int mask = pikoir_gpu_activemask();
                     shared->values[i] = mask;
                     shared->seen[i] = pikoir_gpu_shuffle(mask, 100 + i, 5, 31);
                   }),
            "");
  for (int i = 0; i < 32; ++i) {
    EXPECT_EQ(uint32_t(state.values[i]), i % 2 ? 0xaaaaaaaau : 0u) << i;
    EXPECT_EQ(state.seen[i], i % 2 ? 105 : 0) << i;
  }
}

TEST(Emulator, BlocksInAnOrderThatTheSeedSays) {
  auto order = [](int64_t seed) {
    Shared state;
    EXPECT_EQ(launch(state, 16, 1, seed,
                     [] { shared->blocks.push_back(pikoir_gpu_block()); }),
              "");
    return state.blocks;
  };
  std::vector<int> plain = order(0), one = order(1), two = order(2);
  for (int i = 0; i < 16; ++i)
    EXPECT_EQ(plain[i], i);
  EXPECT_NE(one, plain);
  EXPECT_NE(one, two);
  std::sort(one.begin(), one.end());
  EXPECT_EQ(one, plain);
}
