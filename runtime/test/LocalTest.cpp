// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- LocalTest.cpp - Stages after local edges --------------------------===//
//
// "work" has 20 bins of 4 buckets and emits each primitive `copies` times to
// "list", which gets it in batches of 2, and once to "drain". "list" hands each
// batch on to "again", and a record of its own for each call to "drain";
// "again" hands all on to "drain". So drain merges three edges, of stages in
// one kernel.
//
//===----------------------------------------------------------------------===//

#include "pikort/emission.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <string>
#include <vector>

namespace {

/// With padding, which must come out as zero.
struct Item {
  int64_t id;
  int8_t bucket;
};

enum { work, list, again, drain };
constexpr int64_t bins = 20;
int64_t copies;
bool everyBin;
int32_t failing; ///< The stages, as bits, that report an error.
std::vector<int64_t> drained;
std::vector<std::multiset<int64_t>> calls; ///< Sizes of each bin's.
std::atomic<bool> paddingSeen;
std::mutex mutex;

void declare(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Local", 1);
  pikoir_declare_record(p, 0, "Item", sizeof(Item), alignof(Item));
  pikoir_declare_field(p, 0, "id", PIKORT_I64, 0, 1, 0);
  pikoir_declare_field(p, 0, "bucket", PIKORT_I8, 8, 1, 0);
  int64_t size = 4;
  int32_t placed = PIKOIR_PLACED;
  pikoir_declare_stage(p, work, "work", 0, &size, 0, 0, placed, 0);
  pikoir_declare_stage(p, list, "list", 0, &size, 0, 0, placed | PIKOIR_LIST,
                       0);
  pikoir_declare_schedule(p, list, 2, everyBin);
  pikoir_declare_stage(p, again, "again", 0, &size, 0, 0,
                       placed | PIKOIR_COLLECTS, 0);
  pikoir_declare_stage(p, drain, "drain", 0, nullptr, 0, 0, 0, 0);
  pikoir_declare_source(p, 0, work);
  pikoir_declare_edge(p, work, 0, list);
  pikoir_declare_edge(p, work, 1, drain);
  pikoir_declare_edge(p, list, 0, again);
  pikoir_declare_edge(p, list, 1, drain);
  pikoir_declare_edge(p, again, 0, drain);
  pikoir_declare_keys(p, work, 1);
  pikoir_declare_join(p, work, 1, PIKOIR_PERMUTE, 2);
  pikoir_declare_join(p, list, 1, PIKOIR_CONCATENATE, 2);
  pikoir_declare_join(p, again, 0, PIKOIR_CONCATENATE, 2);
  pikoir_declare_root(p, list, 1);
  pikoir_declare_root(p, again, 2);
}

void setup(pikort_pipeline *p) {
  declare(p);
  pikoir_declare_local(p, list, 0); // in any order
  pikoir_declare_local(p, work, 0);
}

void emit(pikoir_writer *w, int32_t port, int64_t id, int64_t bucket,
          bool place) {
  auto *room = reinterpret_cast<Item *>(pikoir_append_inline(w, port));
  room->id = id;
  room->bucket = static_cast<int8_t>(bucket);
  if (!place)
    return;
  if (w->ports[port].flags & PIKOIR_PORT_LOCAL)
    pikoir_place_local_inline(w, port, bucket);
  else
    pikoir_place_inline(w, port, bucket);
}

const Item &itemAt(const pikoir_input *in, int64_t position) {
  auto *items = reinterpret_cast<const Item *>(in->items);
  return items[in->order ? in->order[position] : position];
}

void fail(pikort_pipeline *p, int32_t stage) {
  if (failing & 1 << stage)
    pikoir_fail(p, stage, nullptr, -1, PIKORT_ENDLESS, stage, 0);
}

void runBin(pikort_pipeline *p, pikoir_writer *const (&writers)[3],
            int64_t bucket) {
  const pikoir_input *in = pikoir_begin_local(writers[work], 0);
  for (int64_t c = in->units[0].bucket_begin; c < in->units[0].bucket_end;
       ++c) {
    const pikoir_call &call = in->calls[c];
    {
      std::lock_guard<std::mutex> lock(mutex);
      calls[static_cast<size_t>(bucket)].insert(call.end - call.begin);
    }
    for (int64_t i = call.begin; i < call.end; ++i)
      emit(writers[list], 0, itemAt(in, i).id, bucket, true);
    emit(writers[list], 1, 1000000 + bucket, bucket, false);
    fail(p, list);
  }
  pikoir_next(writers[list]);
  pikoir_end_local(writers[work], 0);

  in = pikoir_begin_local(writers[list], 0);
  for (int64_t i = in->units[0].begin; i < in->units[0].end; ++i) {
    for (size_t b = 9; b < sizeof(Item); ++b)
      if (reinterpret_cast<const char *>(&itemAt(in, i))[b] != 0)
        paddingSeen = true;
    emit(writers[again], 0, 2000000 + itemAt(in, i).id, bucket, false);
  }
  pikoir_next(writers[again]);
  pikoir_end_local(writers[list], 0);
}

int32_t runWork(pikort_pipeline *p) {
  const pikoir_input *in = pikoir_begin(p, work);
  if (!in)
    return pikoir_status(p);
#pragma omp parallel for schedule(dynamic) num_threads(pikoir_threads(p))
  for (int64_t u = 0; u < in->unit_count; ++u) {
    pikoir_writer *const writers[3] = {pikoir_open(p, work, u),
                                       pikoir_open(p, list, u),
                                       pikoir_open(p, again, u)};
    for (int64_t c = in->units[u].bucket_begin; c < in->units[u].bucket_end;
         ++c) {
      for (int64_t i = in->offsets[c]; i < in->offsets[c + 1]; ++i) {
        for (int64_t k = 0; k < copies; ++k)
          emit(writers[work], 0, itemAt(in, i).id * 10 + k, c, k != 2);
        emit(writers[work], 1, itemAt(in, i).id, c, false);
        fail(p, work);
        pikoir_next(writers[work]);
      }
      runBin(p, writers, c);
    }
    for (pikoir_writer *w : writers)
      pikoir_close(w);
  }
  return pikoir_end(p, work);
}

int32_t run(pikort_pipeline *p) {
  calls.assign(bins, {});
  const pikoir_input *in = pikoir_begin_source(p, 0);
  if (!in)
    return pikoir_status(p);
  for (int64_t u = 0; u < in->unit_count; ++u) {
    pikoir_writer *w = pikoir_open_source(p, 0, u);
    for (int64_t i = in->units[u].begin; i < in->units[u].end; ++i) {
      pikoir_place_source(w, itemAt(in, i).bucket);
      pikoir_next(w);
    }
    pikoir_close(w);
  }
  if (int32_t status = pikoir_end_source(p, 0))
    return status;
  if (int32_t status = runWork(p))
    return status;
  if (!(in = pikoir_begin(p, drain)))
    return pikoir_status(p);
  for (int64_t i = 0; i < in->count; ++i)
    drained.push_back(itemAt(in, i).id);
  return pikoir_end(p, drain);
}

class Local : public testing::Test {
protected:
  void SetUp() override {
    copies = 5;
    everyBin = false;
    failing = 0;
    paddingSeen = false;
    for (int64_t i = 0; i < 300; ++i) // none in the last bins
      input.push_back({i, static_cast<int8_t>(i * 7 % 17)});
  }
  std::string runOn(int32_t threads, int32_t code = PIKORT_OK,
                    int64_t limit = 0) {
    pikort_program program{PIKORT_ABI_VERSION, "Local", setup, run};
    piko::rt::Pipeline pipe(program);
    EXPECT_TRUE(pipe.created()) << pipe.created().message();
    EXPECT_TRUE(pipe.domain({4 * bins}));
    EXPECT_TRUE(pipe.source(0, input));
    EXPECT_TRUE(pipe.threads(threads));
    if (limit)
      pipe.memoryLimit(limit);
    drained.clear();
    piko::rt::Status status = pipe.run();
    EXPECT_EQ(status.code(), code) << status.message();
    EXPECT_FALSE(paddingSeen);
    return status.message();
  }
  /// What reaches drain, in lineage order: what work emits, as the source has
  /// it; then, bin by bin, what list does; then what again does.
  std::vector<int64_t> expected() {
    std::vector<int64_t> first, second, third;
    for (const Item &item : input)
      first.push_back(item.id);
    for (int64_t bucket = 0; bucket < bins; ++bucket) {
      int64_t count = 0;
      for (const Item &item : input)
        for (int64_t k = 0; item.bucket == bucket && k < copies; ++k)
          if (k != 2) {
            ++count;
            third.push_back(2000000 + item.id * 10 + k);
          }
      second.insert(second.end(),
                    static_cast<size_t>(count ? (count + 1) / 2 : everyBin),
                    1000000 + bucket);
    }
    first.insert(first.end(), second.begin(), second.end());
    first.insert(first.end(), third.begin(), third.end());
    return first;
  }
  std::vector<Item> input;
};

TEST_F(Local, KeepsLineage) {
  for (int32_t threads : {1, 2, 7}) {
    runOn(threads);
    EXPECT_EQ(drained, expected()) << threads << " threads";
  }
  EXPECT_EQ(calls[3].count(2), calls[3].size());
  EXPECT_TRUE(calls[19].empty());
}

TEST_F(Local, RunsForEmptyBins) {
  everyBin = true;
  for (int32_t threads : {1, 7}) {
    runOn(threads);
    EXPECT_EQ(drained, expected()) << threads << " threads";
  }
  EXPECT_EQ(calls[19], (std::multiset<int64_t>{0}));
  input.clear();
  runOn(2);
  EXPECT_EQ(drained, expected());
  EXPECT_EQ(drained.size(), static_cast<size_t>(bins));
}

TEST_F(Local, GrowsAndIsLimited) {
  copies = 2000;
  runOn(2);
  EXPECT_EQ(drained, expected());
  std::string message = runOn(1, PIKORT_OUT_OF_MEMORY, 600000);
  EXPECT_NE(message.find("stage 'list': out of memory: expected"),
            std::string::npos)
      << message;
}

// With a kernel break, list would not have begun.
TEST_F(Local, ReportsTheProducersErrorsFirst) {
  failing = 1 << list;
  EXPECT_NE(runOn(2, PIKORT_ENDLESS).find("stage 'list'"), std::string::npos);
  failing |= 1 << work;
  EXPECT_NE(runOn(2, PIKORT_ENDLESS).find("stage 'work'"), std::string::npos);
}

TEST_F(Local, RefusesWrongEdges) {
  auto expect = [](void (*setup)(pikort_pipeline *), const char *text) {
    pikort_program program{PIKORT_ABI_VERSION, "Local", setup, run};
    piko::rt::Pipeline pipe(program);
    EXPECT_EQ(pipe.created().code(), PIKORT_BAD_PROGRAM);
    EXPECT_NE(pipe.created().message().find(text), std::string::npos)
        << pipe.created().message();
  };
  expect(
      [](pikort_pipeline *p) {
        declare(p);
        pikoir_declare_local(p, list, 7);
      },
      "expected the port of a local edge");
  expect(
      [](pikort_pipeline *p) {
        declare(p);
        pikoir_declare_local(p, work, 1);
      },
      "stage 'drain': expected a local edge between stages with the same bins");
}

} // namespace
