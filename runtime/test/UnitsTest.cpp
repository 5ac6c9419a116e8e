// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- UnitsTest.cpp - Which thread runs which unit -----------------------===//

#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <algorithm>
#include <atomic>
#include <gtest/gtest.h>
#include <omp.h>
#include <vector>

namespace {

constexpr int64_t bins = 64, threads = 4;
int32_t schedule;                    // of all bins
std::vector<pikoir_unit> units;      // of the latest run
std::vector<int64_t> taken[threads]; // units, by thread
void (*share)(const pikoir_input *input) = nullptr;

/// More in the first bins than in all others.
int64_t binOf(int64_t item) {
  return item % 4 ? item / 4 % 8 : item / 4 % bins;
}

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Units", 1);
  pikoir_declare_record(p, 0, "Item", 8, 8);
  pikoir_declare_field(p, 0, "field", PIKORT_I64, 0, 1, 0);
  int64_t bin = 1;
  pikoir_declare_stage(p, 0, "draw", 0, &bin, schedule, 0, PIKOIR_PLACED, 0);
  pikoir_declare_source(p, 0, 0);
}

int32_t run(pikort_pipeline *p) {
  const pikoir_input *in = pikoir_begin_source(p, 0);
  for (int64_t u = 0; u < in->unit_count; ++u) {
    pikoir_writer *w = pikoir_open_source(p, 0, u);
    for (int64_t i = in->units[u].begin; i < in->units[u].end; ++i) {
      pikoir_place_source(w, binOf(i));
      pikoir_next(w);
    }
    pikoir_close(w);
  }
  if (int32_t status = pikoir_end_source(p, 0))
    return status;
  in = pikoir_begin(p, 0);
  units.assign(in->units, in->units + in->unit_count);
  for (std::vector<int64_t> &list : taken)
    list.clear();
  share(in);
  return pikoir_end(p, 0);
}

void takeAll(const pikoir_input *input) {
  std::vector<int64_t> &list = taken[omp_get_thread_num()];
  for (int64_t u; (u = pikoir_next_unit(input)) >= 0;)
    list.push_back(u);
}

int64_t takeFrom(pikoir_cursor &cursor) {
  return std::atomic_ref(cursor.next).fetch_add(1, std::memory_order_relaxed);
}

/// As a kernel does whose schedule is eliminated.
void takeNext(const pikoir_input *input) {
  std::vector<int64_t> &list = taken[omp_get_thread_num()];
  for (int64_t u; (u = takeFrom(input->cursors[0])) < input->unit_count;)
    list.push_back(u);
}

/// As one does that is pre-scheduled: first its own.
void takeOwn(const pikoir_input *input) {
  int64_t thread = omp_get_thread_num();
  pikoir_cursor &cursor = input->cursors[PIKOIR_CURSOR_HOMES + thread];
  for (int64_t u; (u = takeFrom(cursor)) < cursor.end;) {
    EXPECT_EQ(input->units[u].owner, thread);
    taken[thread].push_back(u);
  }
  takeAll(input);
}

/// Of two threads, the first one begins when the other one has found no more.
void takeLate(const pikoir_input *input) {
#pragma omp parallel num_threads(2)
  {
    if (omp_get_thread_num() == 1)
      takeAll(input);
#pragma omp barrier
    if (omp_get_thread_num() == 0)
      takeAll(input);
  }
}

void runUnits(int32_t kind, void (*how)(const pikoir_input *input)) {
  schedule = kind;
  share = how;
  static const pikort_program program{PIKORT_ABI_VERSION, "Units", setup, run};
  piko::rt::Pipeline pipe{program};
  ASSERT_TRUE(pipe.created()) << pipe.created().message();
  std::vector<int64_t> input(40000);
  ASSERT_TRUE(pipe.domain({bins}));
  ASSERT_TRUE(pipe.source(0, input));
  ASSERT_TRUE(pipe.threads(threads));
  ASSERT_TRUE(pipe.run());
}

/// Each unit ran once.
void checkOnce() {
  std::vector<int64_t> all;
  for (const std::vector<int64_t> &list : taken)
    all.insert(all.end(), list.begin(), list.end());
  std::sort(all.begin(), all.end());
  ASSERT_EQ(all.size(), units.size());
  for (size_t unit = 0; unit < all.size(); ++unit)
    EXPECT_EQ(all[unit], static_cast<int64_t>(unit));
}

// Whatever is in the bins, each core is the home of as many primitives, in
// neighbouring bins.
TEST(Units, HomesAreBalanced) {
  runUnits(PIKOIR_DIRECT_MAP, takeAll);
  int64_t positions[threads] = {}, owner = 0;
  for (const pikoir_unit &unit : units) {
    EXPECT_GE(unit.owner, owner);
    owner = unit.owner;
    ASSERT_LT(owner, threads);
    positions[owner] += unit.end - unit.begin;
  }
  // A bin of the first ones has about 4,000 primitives, and is not divided.
  for (int64_t count : positions)
    EXPECT_NEAR(static_cast<double>(count), 10000, 4000);
  checkOnce(); // by one thread
}

// Who is late finds that others have done its units.
TEST(Units, OthersTakeOver) {
  runUnits(PIKOIR_DIRECT_MAP, takeLate);
  checkOnce();
  EXPECT_TRUE(taken[0].empty());
  // Its own come first: with two threads, those of every other home.
  ASSERT_FALSE(taken[1].empty());
  EXPECT_EQ(units[static_cast<size_t>(taken[1].front())].owner % 2, 1);
  EXPECT_EQ(units[static_cast<size_t>(taken[1].back())].owner % 2, 0);
}

TEST(Units, OnlyTheFirstRunsSerializedBins) {
  runUnits(PIKOIR_SERIALIZE, takeLate);
  checkOnce();
  EXPECT_TRUE(taken[1].empty());
}

TEST(Units, KernelsTakeThemWithoutACall) {
  for (int32_t kind :
       {PIKOIR_LOAD_BALANCE, PIKOIR_DIRECT_MAP, PIKOIR_SERIALIZE, PIKOIR_ALL}) {
    runUnits(kind, [](const pikoir_input *input) {
#pragma omp parallel num_threads(threads)
      takeNext(input);
    });
    checkOnce();
  }
  for (void (*how)(const pikoir_input *) :
       {+[](const pikoir_input *input) {
#pragma omp parallel num_threads(threads)
          takeOwn(input);
        },
        +[](const pikoir_input *input) { // of fewer than homes
#pragma omp parallel num_threads(2)
          takeOwn(input);
        }}) {
    runUnits(PIKOIR_DIRECT_MAP, how);
    checkOnce();
  }
}

TEST(Units, AllThreadsAtOnce) {
  for (int32_t kind : {PIKOIR_LOAD_BALANCE, PIKOIR_DIRECT_MAP, PIKOIR_ALL}) {
    runUnits(kind, [](const pikoir_input *input) {
#pragma omp parallel num_threads(threads)
      takeAll(input);
    });
    checkOnce();
  }
}

} // namespace
