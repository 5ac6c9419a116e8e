// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- RanksTest.cpp - One pipeline as several ranks ----------------------===//

#include "pikort/ranks.h"
#include "pikort/abi.h"
#include "pikort/abi_ranks.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>
#include <numeric>
#include <thread>

namespace {

/// Adds up the primitives of a source, and finds the largest; 666 is an error.
void declare(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Sums", 1);
  pikoir_declare_record(p, 0, "Word", 8, 8);
  pikoir_declare_field(p, 0, "word", PIKORT_I64, 0, 1, 0);
  for (int32_t id : {0, 1}) {
    pikoir_declare_state(p, id, id == 0 ? "sum" : "most", PIKORT_BUFFER, 0, 1,
                         -1, nullptr);
    pikoir_declare_written(p, id);
  }
  int64_t bins[] = {0};
  pikoir_declare_stage(p, 0, "add", 0, bins, PIKOIR_LOAD_BALANCE, 0,
                       PIKOIR_SPLIT | PIKOIR_WRITES, 0);
  pikoir_declare_source(p, 0, 0);
}

void setup(pikort_pipeline *p) {
  declare(p);
  pikoir_declare_partition(p, 0, PIKOIR_PARTS);
}

int32_t add(pikort_pipeline *p) {
  const pikoir_input *in = pikoir_begin(p, 0);
  if (!in)
    return pikoir_status(p);
  auto *sum = reinterpret_cast<int64_t *>(pikoir_get_state(p, 0)->data);
  auto *most = reinterpret_cast<int64_t *>(pikoir_get_state(p, 1)->data);
  for (int64_t u = 0; u < in->unit_count; ++u) {
    pikoir_writer *w = pikoir_open(p, 0, u);
    for (int64_t i = in->units[u].begin; i < in->units[u].end; ++i) {
      int64_t item = reinterpret_cast<const int64_t *>(in->items)[i];
      if (item == 666)
        pikoir_fail(p, 0, nullptr, 0, PIKORT_INDEX_OUTSIDE, item, i);
      *sum += item;
      *most = std::max(*most, item);
      pikoir_next(w);
    }
    pikoir_close(w);
  }
  return pikoir_end(p, 0);
}

int32_t run(pikort_pipeline *p) {
  for (int32_t id : {0, 1})
    if (int32_t status = pikoir_keep(p, id))
      return status;
  if (int32_t status = add(p))
    return status;
  pikoir_share_field(p, 0, 0, 1, 0, 8, PIKOIR_SHARE_ADD);
  if (int32_t status = pikoir_share(p, 0, -1, 0))
    return status;
  pikoir_share_field(p, 1, 0, 1, 0, 8, PIKOIR_SHARE_MAX);
  return pikoir_share(p, 1, -1, 0);
}

constexpr pikort_program program{PIKORT_ABI_VERSION, "Sums", setup, run};

class Ranks : public testing::Test {
protected:
  Ranks() : items(100) {
    std::iota(items.begin(), items.end(), 1);
    EXPECT_TRUE(pipe.domain({1}));
    bind(pipe);
  }
  void bind(piko::rt::Pipeline &to) {
    EXPECT_TRUE(to.source(0, items));
    EXPECT_TRUE(to.buffer("sum", sum));
    EXPECT_TRUE(to.buffer("most", most));
  }
  std::string messageOf(int32_t status) {
    EXPECT_NE(status, PIKORT_OK);
    return pikort_message(pipe.get());
  }

  piko::rt::Pipeline pipe{program};
  std::vector<int64_t> items, sum{1000}, most{-5};
};

// What ranks change of a buffer is combined, and each run begins with the same.
TEST_F(Ranks, Combine) {
  int64_t expected = 1000;
  for (int32_t ranks : {1, 2, 3, 7, 120}) {
    ASSERT_EQ(pikort_set_thread_ranks(pipe.get(), ranks), PIKORT_OK);
    for (int turn = 0; turn < 2; ++turn) {
      auto status = pipe.run();
      ASSERT_TRUE(status) << status.message();
      expected += 5050;
      EXPECT_EQ(sum[0], expected) << ranks << " ranks";
      EXPECT_EQ(most[0], 100);
    }
    EXPECT_EQ(pikort_rank_count(pipe.get()), ranks == 1 ? 0 : ranks);
  }
  pikort_rank_totals totals;
  EXPECT_EQ(pikort_get_rank_totals(pipe.get(), 119, &totals), PIKORT_OK);
  EXPECT_GT(totals.bytes, 0);
  EXPECT_EQ(pikort_get_rank_totals(pipe.get(), 120, &totals), PIKORT_NOT_FOUND);
}

// In C++ a communicator outlives what its host keeps, and an error is said.
TEST_F(Ranks, Communicators) {
  std::vector<pikort_ranks> two(2);
  ASSERT_EQ(pikort_make_thread_ranks(2, two.data()), PIKORT_OK);
  std::vector<int64_t> otherSum = sum, otherMost = most;
  std::thread other([&] {
    piko::rt::Pipeline second{program};
    EXPECT_TRUE(second.domain({1}));
    EXPECT_TRUE(second.source(0, items));
    EXPECT_TRUE(second.buffer("sum", otherSum));
    EXPECT_TRUE(second.buffer("most", otherMost));
    EXPECT_TRUE(second.ranks(piko::rt::Communicator(two[1])));
    EXPECT_TRUE(second.run());
  });
  EXPECT_TRUE(pipe.ranks(piko::rt::Communicator(two[0])));
  piko::rt::Pipeline moved = std::move(pipe);
  auto status = moved.run();
  other.join();
  EXPECT_TRUE(status) << status.message();
  EXPECT_EQ(sum[0], 6050);
  EXPECT_EQ(otherSum[0], 6050);
  pikort_ranks wrong = two[0];
  wrong.rank = 2;
  piko::rt::Status refused = moved.ranks(piko::rt::Communicator(wrong));
  EXPECT_EQ(refused.code(), PIKORT_INVALID_ARGUMENT);
  EXPECT_NE(refused.message().find("but got 2 of 2"), std::string::npos)
      << refused.message();
  EXPECT_EQ(moved.threadRanks(-1).code(), PIKORT_INVALID_ARGUMENT);
  pikort_free_thread_ranks(two.data());
}

// An error is that of one process, whichever rank has found it, and the next
// run is as if there had been none.
TEST_F(Ranks, Errors) {
  items[70] = items[90] = 666;
  std::string expected = messageOf(pikort_run(pipe.get()));
  ASSERT_NE(expected.find("got 666"), std::string::npos) << expected;
  for (int32_t ranks : {2, 3, 100}) {
    ASSERT_EQ(pikort_set_thread_ranks(pipe.get(), ranks), PIKORT_OK);
    std::string got = messageOf(pikort_run(pipe.get()));
    EXPECT_EQ(got.substr(0, got.find(" in [")),
              expected.substr(0, expected.find(" in [")));
    std::swap(items[70], items[90]);
  }
  items[70] = items[90] = 0;
  sum[0] = 0;
  EXPECT_TRUE(pipe.run());
  EXPECT_EQ(sum[0], 5050 - 71 - 91);
}

TEST_F(Ranks, Refusals) {
  pikort_ranks ranks{0, 2, nullptr, nullptr, nullptr};
  EXPECT_EQ(
      messageOf(pikort_set_ranks(pipe.get(), &ranks)),
      "pipeline 'Sums': expected a rank below the number of ranks, from 1 "
      "to 65536, and functions, but got 0 of 2");
  EXPECT_EQ(messageOf(pikort_set_thread_ranks(pipe.get(), -1)),
            "pipeline 'Sums': expected a number of ranks from 0 to 1024, but "
            "got -1");
  piko::rt::Pipeline whole({PIKORT_ABI_VERSION, "Whole", declare, run});
  EXPECT_EQ(pikort_set_thread_ranks(whole.get(), 2), PIKORT_INVALID_ARGUMENT);
  EXPECT_STREQ(pikort_message(whole.get()),
               "pipeline 'Sums': expected a program that is compiled for ranks "
               "(pikoc --ranks)");
  EXPECT_EQ(pikort_set_ranks(whole.get(), &ranks), PIKORT_INVALID_ARGUMENT);
  EXPECT_EQ(pikort_make_thread_ranks(0, &ranks), PIKORT_INVALID_ARGUMENT);
}

// Who owns which bins is no result; what cannot be is said.
TEST_F(Ranks, Owners) {
  EXPECT_EQ(messageOf(pikort_set_rank_owners(pipe.get(), 5)),
            "pipeline 'Sums': expected a way to find owners of bins, but got "
            "5");
  ASSERT_EQ(pikort_set_rank_owners(pipe.get(), PIKORT_OWNERS_LOAD), PIKORT_OK);
  ASSERT_EQ(pikort_set_thread_ranks(pipe.get(), 3), PIKORT_OK);
  EXPECT_TRUE(pipe.run());
  EXPECT_EQ(sum[0], 1000 + 5050);
  setenv("PIKO_RANK_OWNERS", "mine", 1);
  EXPECT_EQ(messageOf(pikort_run(pipe.get())),
            "PIKO_RANK_OWNERS: expected pattern, blocks, morton or load, but "
            "got 'mine'");
  unsetenv("PIKO_RANK_OWNERS");
  EXPECT_TRUE(pipe.run());
}

// A network that fails ends this run and all later ones.
TEST_F(Ranks, BrokenNetwork) {
  pikort_ranks ranks{1, 2, nullptr,
                     [](void *, const void *const *, const int64_t *,
                        void *const *, const int64_t *) { return 1; },
                     [](void *) { return "the wire is cut"; }};
  ASSERT_EQ(pikort_set_ranks(pipe.get(), &ranks), PIKORT_OK);
  for (int turn = 0; turn < 2; ++turn) {
    EXPECT_EQ(messageOf(pikort_run(pipe.get())),
              "pipeline 'Sums': rank 1 of 2: the wire is cut");
    EXPECT_EQ(pikort_run(pipe.get()), PIKORT_RANK_FAILED);
  }
  ASSERT_EQ(pikort_set_ranks(pipe.get(), nullptr), PIKORT_OK);
  EXPECT_TRUE(pipe.run());
}

// Whenever memory is refused on one rank, it is that rank's error on all.
TEST_F(Ranks, RefusedMemory) {
  sum.resize(3000);
  EXPECT_TRUE(pipe.buffer("sum", sum));
  pikort_ranks ranks[2];
  ASSERT_EQ(pikort_make_thread_ranks(2, ranks), PIKORT_OK);
  ASSERT_EQ(pikort_set_ranks(pipe.get(), &ranks[0]), PIKORT_OK);
  piko::rt::Pipeline other{program};
  ASSERT_TRUE(other.domain({1}));
  std::vector<int64_t> otherSum = sum, otherMost = most;
  ASSERT_TRUE(other.source(0, items) && other.buffer("sum", otherSum) &&
              other.buffer("most", otherMost));
  ASSERT_EQ(pikort_set_ranks(other.get(), &ranks[1]), PIKORT_OK);
  int refused = 0;
  bool hasRun = false;
  for (int64_t bytes = 4 << 10; !hasRun && bytes < (1 << 20);
       bytes += 4 << 10) {
    ASSERT_EQ(pikort_set_memory_limit(other.get(), bytes), PIKORT_OK);
    int32_t status = 0;
    std::thread thread([&] { status = pikort_run(other.get()); });
    hasRun = pikort_run(pipe.get()) == PIKORT_OK;
    thread.join();
    EXPECT_EQ(hasRun, status == PIKORT_OK);
    if (hasRun)
      continue;
    ++refused;
    EXPECT_EQ(status, PIKORT_OUT_OF_MEMORY);
    std::string message = pikort_message(pipe.get());
    EXPECT_TRUE(message.starts_with("rank 1: ")) << message;
    EXPECT_EQ(message, pikort_message(other.get()));
  }
  EXPECT_TRUE(hasRun);
  EXPECT_GT(refused, 1);
  ASSERT_EQ(pikort_set_ranks(pipe.get(), nullptr), PIKORT_OK);
  ASSERT_EQ(pikort_set_ranks(other.get(), nullptr), PIKORT_OK);
  pikort_free_thread_ranks(ranks);
}

// Who leaves is not waited for.
TEST_F(Ranks, Leaves) {
  pikort_ranks ranks[2];
  ASSERT_EQ(pikort_make_thread_ranks(2, ranks), PIKORT_OK);
  ASSERT_EQ(pikort_set_ranks(pipe.get(), &ranks[0]), PIKORT_OK);
  std::thread other([&] { pikort_leave_thread_ranks(&ranks[1]); });
  EXPECT_EQ(messageOf(pikort_run(pipe.get())),
            "pipeline 'Sums': rank 0 of 2: a rank has left the run");
  other.join();
  ASSERT_EQ(pikort_set_ranks(pipe.get(), nullptr), PIKORT_OK);
  pikort_free_thread_ranks(ranks);
}

} // namespace
