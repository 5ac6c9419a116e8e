// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- WriterTest.cpp - Reordered emissions, scratch, schedules
//------------===//

#include "pikort/emission.h"
#include "pikort/pikort.hpp"

#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace {

/// With padding, which must come out as zero.
struct Item {
  int64_t id;
  int8_t kind;
};

// One call of stage "work" runs `body`; stage "drain", of 4 bins, notes what it
// gets. `schedule` comes before.
std::function<void(pikoir_writer *)> body;
std::function<void(pikort_pipeline *)> schedule;
std::vector<int64_t> drained;
bool paddingSeen;

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Writer", 1);
  pikoir_declare_record(p, 0, "Item", sizeof(Item), alignof(Item));
  pikoir_declare_field(p, 0, "id", PIKORT_I64, 0, 1, 0);
  pikoir_declare_field(p, 0, "kind", PIKORT_I8, 8, 1, 0);
  int64_t bins = 1;
  pikoir_declare_stage(p, 0, "work", 0, nullptr, 0, 0, 0, 0);
  pikoir_declare_stage(p, 1, "drain", 0, &bins, 0, 0,
                       PIKOIR_PLACED | PIKOIR_LIST, 0);
  pikoir_declare_source(p, 0, 0);
  pikoir_declare_edge(p, 0, 0, 1);
}

int32_t run(pikort_pipeline *p) {
  if (schedule)
    schedule(p);
  const pikoir_input *in = pikoir_begin(p, 0);
  if (!in)
    return pikoir_status(p);
  pikoir_writer *w = pikoir_open(p, 0, 0);
  body(w);
  pikoir_next(w);
  pikoir_close(w);
  if (int32_t status = pikoir_end(p, 0))
    return status;
  if (!(in = pikoir_begin(p, 1)))
    return pikoir_status(p);
  auto *items = reinterpret_cast<const Item *>(in->items);
  for (int64_t c = 0; c < in->call_count; ++c)
    for (int64_t i = in->calls[c].begin; i < in->calls[c].end; ++i) {
      const Item &item = items[in->order ? in->order[i] : i];
      drained.push_back(item.id);
      const char *bytes = reinterpret_cast<const char *>(&item);
      for (size_t b = 9; b < sizeof(Item); ++b)
        paddingSeen |= bytes[b] != 0;
    }
  return pikoir_end(p, 1);
}

void emit(pikoir_writer *w, int64_t id, int64_t bucket, bool fast = false) {
  auto *room = reinterpret_cast<Item *>(fast ? pikoir_append_inline(w, 0)
                                             : pikoir_append(w, 0));
  room->id = id;
  room->kind = 1;
  fast ? pikoir_place_inline(w, 0, bucket) : pikoir_place(w, 0, bucket);
}

const pikort_program program{PIKORT_ABI_VERSION, "Writer", setup, run};

class Writer : public testing::Test {
protected:
  void SetUp() override {
    ASSERT_TRUE(pipe.created()) << pipe.created().message();
    ASSERT_TRUE(pipe.domain({4}));
    ASSERT_TRUE(pipe.source(0, input));
    ASSERT_TRUE(pipe.threads(1));
    body = nullptr;
    schedule = nullptr;
    drained.clear();
    paddingSeen = false;
  }
  /// Runs; returns the message.
  std::string runWith(std::function<void(pikoir_writer *)> now,
                      int32_t code = PIKORT_OK) {
    body = std::move(now);
    drained.clear();
    piko::rt::Status status = pipe.run();
    EXPECT_EQ(status.code(), code) << status.message();
    EXPECT_FALSE(paddingSeen);
    return status.message();
  }
  std::vector<Item> input = {{7, 0}};
  piko::rt::Pipeline pipe{program};
};

// --- Reordered emissions -----------------------------------------------------

TEST_F(Writer, ReordersByIteration) {
  runWith([](pikoir_writer *w) {
    emit(w, -1, 0, true);
    pikoir_reorder_begin(w, 3);
    for (int64_t round = 0; round < 2; ++round)
      for (int64_t i : {2, 0, 1}) {
        pikoir_reorder_iteration(w, i);
        emit(w, 10 * i + round, 0, round == 0);
      }
    pikoir_reorder_end(w);
    emit(w, 99, 0, true);
  });
  EXPECT_EQ(drained, (std::vector<int64_t>{-1, 0, 1, 10, 11, 20, 21, 99}));
}

// Buckets stay with their record; one without a bucket is dropped.
TEST_F(Writer, ReordersPlaces) {
  runWith([](pikoir_writer *w) {
    pikoir_reorder_begin(w, 2);
    pikoir_reorder_iteration(w, 1);
    emit(w, 5, 3);
    pikoir_place_inline(w, 0, 1);
    pikoir_append_inline(w, 0);
    pikoir_reorder_iteration(w, 0);
    emit(w, 4, 1);
    pikoir_reorder_end(w);
  });
  EXPECT_EQ(drained, (std::vector<int64_t>{4, 5, 5}));
}

TEST_F(Writer, ReordersMany) {
  constexpr int64_t count = 200000;
  runWith([](pikoir_writer *w) {
    for (int repeat = 0; repeat < 2; ++repeat) {
      pikoir_reorder_begin(w, count);
      for (int64_t i = count; i-- > 0;) {
        pikoir_reorder_iteration(w, i);
        emit(w, i, 0);
      }
      pikoir_reorder_end(w);
    }
  });
  ASSERT_EQ(drained.size(), size_t(2 * count));
  for (int64_t i = 0; i < 2 * count; ++i)
    ASSERT_EQ(drained[static_cast<size_t>(i)], i % count);
}

TEST_F(Writer, WrongCallsOfReorder) {
  auto expect = [&](std::function<void(pikoir_writer *)> wrong,
                    const char *text) {
    EXPECT_EQ(runWith(wrong, PIKORT_BAD_PROGRAM),
              std::string("stage 'work': ") + text);
  };
  expect(
      [](pikoir_writer *w) {
        pikoir_reorder_begin(w, 1);
        pikoir_reorder_begin(w, 1);
        pikoir_reorder_end(w);
      },
      "expected reordered emissions to end before others begin");
  expect([](pikoir_writer *w) { pikoir_reorder_end(w); },
         "expected pikoir_reorder_begin before an iteration and the end");
  for (int64_t bad : {-1, 2})
    expect(
        [=](pikoir_writer *w) {
          pikoir_reorder_begin(w, 2);
          pikoir_reorder_iteration(w, bad);
          pikoir_reorder_end(w);
        },
        "expected an iteration of those that pikoir_reorder_begin named");
  expect([](pikoir_writer *w) { pikoir_reorder_begin(w, 2); },
         "expected pikoir_reorder_end before the position ends");
  expect(
      [](pikoir_writer *w) {
        pikoir_reorder_begin(w, 1);
        pikoir_place(w, 0, 0);
        pikoir_reorder_end(w);
      },
      "expected a record before its place");
}

// The error of a place is found though it is late.
TEST_F(Writer, ReordersBadPlaces) {
  EXPECT_EQ(runWith(
                [](pikoir_writer *w) {
                  pikoir_reorder_begin(w, 1);
                  emit(w, 1, 4, true);
                  pikoir_reorder_end(w);
                },
                PIKORT_BIN_OUTSIDE),
            "stage 'drain': expected a bin id in [0, 4), but got 4");
}

// --- Scratch ----------------------------------------------------------------

// --- Reserved room ----------------------------------------------------------

// As many as there is room for lie one after the other, across blocks.
TEST_F(Writer, ReservesRoom) {
  constexpr int64_t rounds = 3000;
  runWith([](pikoir_writer *w) {
    int64_t id = 0;
    for (int64_t round = 0; round < rounds; ++round) {
      int64_t count = round % PIKOIR_MOST_RESERVED + 1;
      pikoir_reserve(w, 0, count);
      pikoir_port &port = w->ports[0];
      ASSERT_LE(port.cursor + (count - 1) * port.size, port.limit);
      auto *room = reinterpret_cast<Item *>(port.cursor);
      for (int64_t i = 0; i < count; ++i) {
        room[i].id = id + i;
        room[i].kind = 1;
      }
      for (int64_t i = 0; i < count; ++i) {
        ++port.emitted;
        port.last_bucket = -1;
        pikoir_place(w, 0, 0);
      }
      id += count;
      emit(w, id++, 0, true);
    }
  });
  ASSERT_GT(drained.size(), size_t(rounds));
  for (size_t i = 0; i < drained.size(); ++i)
    ASSERT_EQ(drained[i], int64_t(i));
}

// Where memory is refused, records go to the scratch.
TEST_F(Writer, ReservesRoomThatIsRefused) {
  pikort_set_memory_limit(pipe.get(), 40000);
  runWith(
      [](pikoir_writer *w) {
        for (int round = 0; round < 3; ++round) {
          pikoir_reserve(w, 0, PIKOIR_MOST_RESERVED);
          std::memset(w->ports[0].cursor, 1,
                      PIKOIR_MOST_RESERVED * sizeof(Item));
          w->ports[0].cursor += PIKOIR_MOST_RESERVED * sizeof(Item);
          emit(w, 1, 0);
        }
      },
      PIKORT_OUT_OF_MEMORY);
}

TEST_F(Writer, ScratchIsAStack) {
  runWith([](pikoir_writer *w) {
    int64_t mark = pikoir_scratch_mark(w);
    void *first = pikoir_scratch(w, 100);
    EXPECT_NE(pikoir_scratch(w, 0), nullptr);
    for (int64_t bytes : {1, 64, 100, 1 << 16, 3, 1 << 24, 5}) {
      int64_t inner = pikoir_scratch_mark(w);
      auto *memory = static_cast<uint8_t *>(pikoir_scratch(w, bytes));
      ASSERT_NE(memory, nullptr);
      EXPECT_EQ(reinterpret_cast<uintptr_t>(memory) % 64, 0u);
      memory[0] = memory[bytes - 1] = 1;
      auto *next = static_cast<uint8_t *>(pikoir_scratch(w, 8));
      EXPECT_TRUE(next + 8 <= memory || next >= memory + bytes);
      pikoir_scratch_release(w, inner);
      // What was freed is used again.
      EXPECT_EQ(pikoir_scratch_mark(w), inner);
      EXPECT_EQ(pikoir_scratch(w, bytes), memory);
    }
    pikoir_scratch_release(w, mark);
    EXPECT_EQ(pikoir_scratch(w, 100), first);
  });
}

TEST_F(Writer, ScratchOfEachFrameIsReused) {
  auto use = [](pikoir_writer *w) {
    for (int i = 0; i < 100; ++i)
      EXPECT_NE(pikoir_scratch(w, 100000), nullptr);
  };
  runWith(use);
  int64_t reserved = pikort_reserved_bytes(pipe.get());
  for (int frame = 0; frame < 50; ++frame)
    runWith(use);
  EXPECT_EQ(pikort_reserved_bytes(pipe.get()), reserved);
}

TEST_F(Writer, ScratchRefused) {
  auto ask = [](int64_t bytes) {
    return
        [=](pikoir_writer *w) { EXPECT_EQ(pikoir_scratch(w, bytes), nullptr); };
  };
  EXPECT_EQ(runWith(ask(-5), PIKORT_OUT_OF_MEMORY),
            "stage 'work': expected memory of at least 0 bytes, but got -5");
  EXPECT_EQ(runWith(ask(INT64_MAX), PIKORT_OUT_OF_MEMORY),
            "stage 'work': out of memory: expected 9223372036854775807 more "
            "bytes");
  runWith(ask(INT64_MAX / 2), PIKORT_OUT_OF_MEMORY);
  ASSERT_TRUE(pipe.memoryLimit(1 << 20));
  EXPECT_EQ(runWith(ask(1 << 24), PIKORT_OUT_OF_MEMORY),
            "stage 'work': out of memory: expected 16777216 more bytes, but "
            "the limit is 1048576");
}

// --- Schedules that depend on the bin ---------------------------------------

TEST_F(Writer, WrongSchedules) {
  auto expect = [&](int32_t code, int64_t bin, int64_t tileSplit, int64_t batch,
                    const char *text) {
    schedule = [=](pikort_pipeline *p) {
      EXPECT_EQ(pikoir_begin_schedule(p, 1), 4);
      pikoir_schedule_bin(p, 1, bin, PIKOIR_ALL, tileSplit, batch, 0);
    };
    EXPECT_EQ(runWith([](pikoir_writer *) {}, code), text);
  };
  expect(PIKORT_INVALID_ARGUMENT, 2, 0, 0,
         "stage 'drain', bin 2: expected a batch of at least 1, but got 0");
  expect(PIKORT_INVALID_ARGUMENT, 3, 0, -3,
         "stage 'drain', bin 3: expected a batch of at least 1, but got -3");
  expect(
      PIKORT_INVALID_ARGUMENT, 0, -1, PIKOIR_NO_BATCH,
      "stage 'drain', bin 0: expected a tile split of at least 0, but got -1");
  expect(PIKORT_BAD_PROGRAM, 4, 0, PIKOIR_NO_BATCH,
         "stage 'drain', bin 4: expected a bin and a kind of schedule that "
         "exist, after pikoir_begin_schedule");
  expect(PIKORT_OK, 3, 0, INT64_MAX, "");
  schedule = [](pikort_pipeline *p) {
    EXPECT_EQ(pikoir_begin_schedule(p, 9), 0);
  };
  EXPECT_EQ(runWith([](pikoir_writer *) {}, PIKORT_BAD_PROGRAM),
            "expected the number of a stage, but got 9");
}

} // namespace
