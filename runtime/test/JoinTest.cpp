// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- JoinTest.cpp - Records stay where they were written ----------------===//

#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>
#include <vector>

namespace {

/// A size of which a page is no multiple.
struct Item {
  const Item *self; ///< Where its producer wrote it.
  int64_t id;
  int64_t port;
};

constexpr int64_t bins = 4, count = 50000;
bool isMerged; ///< Stage "emit" has two ports, else one.
int64_t moved;
std::vector<Item> arrived;

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Join", 1);
  pikoir_declare_record(p, 0, "Item", sizeof(Item), alignof(Item));
  for (int32_t f = 0; f < 3; ++f)
    pikoir_declare_field(p, 0, "field", PIKORT_I64, 8 * f, 1, 0);
  int64_t bin = 1;
  pikoir_declare_stage(p, 0, "emit", 0, &bin, 0, 0, PIKOIR_PLACED, 0);
  pikoir_declare_stage(p, 1, "drain", 0, &bin, 0, 0,
                       PIKOIR_PLACED | PIKOIR_ORDERED, 0);
  pikoir_declare_source(p, 0, 0);
  int32_t keys = isMerged ? 2 : 0;
  for (int32_t port = 0; port < 1 + isMerged; ++port) {
    pikoir_declare_edge(p, 0, port, 1);
    pikoir_declare_join(p, 0, port, PIKOIR_PERMUTE, keys);
  }
  if (isMerged)
    pikoir_declare_keys(p, 0, 1);
}

/// Calls body(writer, item) for all positions of a stage.
int32_t runStage(pikort_pipeline *p, int32_t stage, const auto &body) {
  const pikoir_input *in = pikoir_begin(p, stage);
  if (!in)
    return pikoir_status(p);
  auto *items = reinterpret_cast<const Item *>(in->items);
#pragma omp parallel for schedule(dynamic) num_threads(pikoir_threads(p))
  for (int64_t u = 0; u < in->unit_count; ++u) {
    pikoir_writer *w = pikoir_open(p, stage, u);
    for (int64_t i = in->units[u].begin; i < in->units[u].end; ++i) {
      body(w, items[in->order ? in->order[i] : i]);
      pikoir_next(w);
    }
    pikoir_close(w);
  }
  return pikoir_end(p, stage);
}

/// An item to bins that are not those where it is.
void emit(pikoir_writer *w, int64_t id, int64_t port) {
  auto *room =
      reinterpret_cast<Item *>(pikoir_append(w, static_cast<int32_t>(port)));
  *room = {room, id, port};
  pikoir_place(w, static_cast<int32_t>(port), id / 3 % bins);
}

int32_t run(pikort_pipeline *p) {
  const pikoir_input *in = pikoir_begin_source(p, 0);
  if (!in)
    return pikoir_status(p);
  for (int64_t u = 0; u < in->unit_count; ++u) {
    pikoir_writer *w = pikoir_open_source(p, 0, u);
    for (int64_t i = in->units[u].begin; i < in->units[u].end; ++i) {
      pikoir_place_source(w, i % bins);
      pikoir_next(w);
    }
    pikoir_close(w);
  }
  if (int32_t status = pikoir_end_source(p, 0))
    return status;
  int32_t status = runStage(p, 0, [](pikoir_writer *w, const Item &item) {
    for (int64_t port = isMerged; port >= 0; --port)
      emit(w, item.id, port);
  });
  if (status)
    return status;
  return runStage(p, 1, [](pikoir_writer *, const Item &item) {
#pragma omp critical
    {
      moved += item.self != &item;
      arrived.push_back(item);
    }
  });
}

const pikort_program program{PIKORT_ABI_VERSION, "Join", setup, run};

/// Runs, and checks that each bin gets what it should, in order.
void checkJoin(int threads) {
  std::vector<Item> input(count);
  for (int64_t i = 0; i < count; ++i)
    input[static_cast<size_t>(i)] = {nullptr, i, 0};
  moved = 0;
  arrived.clear();
  piko::rt::Pipeline pipe{program};
  ASSERT_TRUE(pipe.created()) << pipe.created().message();
  ASSERT_TRUE(pipe.domain({bins}));
  ASSERT_TRUE(pipe.source(0, input));
  ASSERT_TRUE(pipe.threads(threads));
  ASSERT_TRUE(pipe.run());
  ASSERT_EQ(arrived.size(), static_cast<size_t>(count * (1 + isMerged)));
  EXPECT_EQ(moved, 0);
  std::vector<Item> last(bins, {nullptr, -1, 0});
  for (const Item &item : arrived) {
    Item &before = last[static_cast<size_t>(item.id / 3 % bins)];
    EXPECT_TRUE(before.id < item.id ||
                (before.id == item.id && before.port > item.port));
    before = item;
  }
}

TEST(Join, PermutesNoRecord) {
  isMerged = false;
  checkJoin(1);
  checkJoin(3);
}

TEST(Join, MergesNoRecord) {
  isMerged = true;
  checkJoin(1);
  checkJoin(3);
}

} // namespace
