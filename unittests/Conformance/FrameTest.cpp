//===- FrameTest.cpp - State, from one run to the next --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Fixture.h"

#include <numeric>
#include <optional>
#include <thread>

using namespace conformance;

namespace {

/// The pipeline with all that a host binds, and what must come of it.
struct Host {
  explicit Host(size_t count, unsigned seed = 1)
      : items(makeItems(count, seed)), pipe(make(conformance_Frames_program)) {
    std::iota(table.begin(), table.end(), -3);
    std::iota(finds.begin(), finds.end(), 0);
    EXPECT_TRUE(pipe.constant("scale", scale));
    EXPECT_TRUE(pipe.buffer("table", table));
    EXPECT_TRUE(pipe.buffer("sums", sums));
    EXPECT_TRUE(pipe.buffer("found", found));
    EXPECT_TRUE(pipe.source(0, items));
    EXPECT_TRUE(pipe.source(1, finds));
  }

  /// Runs, and compares all state with what a run now must give.
  void expectFrame() {
    FrameResult expected = conformance::expectFrame(width, height, scale, table,
                                                    sums, items, finds);
    EXPECT_RUNS(pipe);
    EXPECT_EQ(sums, expected.sums);
    EXPECT_EQ(found, expected.found);
    EXPECT_TRUE(isSame(read<Nearest>(pipe, "nearest"), expected.nearest));
    EXPECT_TRUE(isSame(read<int32_t>(pipe, "touched"), expected.touched));
    auto kept = pipe.view<Item>("kept");
    ASSERT_EQ(kept.elements.size(), items.size());
    for (size_t i = 0; i < items.size(); ++i) {
      ASSERT_EQ(kept.elements[i].index, expected.kept[i].index);
      ASSERT_EQ(kept.elements[i].x, expected.kept[i].x);
      ASSERT_EQ(kept.elements[i].kind, expected.kept[i].kind);
    }
  }

  int32_t scale = 2;
  std::vector<int32_t> table = std::vector<int32_t>(16);
  std::vector<int32_t> sums = std::vector<int32_t>(24, 5);
  std::vector<int32_t> found = std::vector<int32_t>(70);
  std::vector<int32_t> finds = std::vector<int32_t>(70);
  Items items;
  Pipeline pipe;
};

TEST(Frame, ImagesAreClearedAndBuffersStay) {
  Host host(900);
  for (int frame = 0; frame < 3; ++frame)
    host.expectFrame();
}

TEST(Frame, RunsWhileTheHostGoesOn) {
  Host host(900);
  for (int frame = 0; frame < 3; ++frame) {
    FrameResult expected =
        conformance::expectFrame(width, height, host.scale, host.table,
                                 host.sums, host.items, host.finds);
    ASSERT_TRUE(host.pipe.runAsync());
    // For the next one.
    ASSERT_TRUE(host.pipe.constant("scale", ++host.scale));
    Status status = host.pipe.wait();
    ASSERT_TRUE(status) << status.message();
    EXPECT_TRUE(host.pipe.isDone());
    EXPECT_EQ(host.sums, expected.sums);
    EXPECT_EQ(host.found, expected.found);
    EXPECT_TRUE(isSame(read<Nearest>(host.pipe, "nearest"), expected.nearest));
  }
}

TEST(Frame, HostChangesItsMemoryBetweenRuns) {
  Host host(300);
  host.expectFrame();
  host.table[4] = 1000;
  std::fill(host.sums.begin(), host.sums.end(), -1);
  host.items[7].z = -4; // sources are read in place
  host.expectFrame();
  host.scale = -7;
  ASSERT_TRUE(host.pipe.constant("scale", host.scale));
  host.expectFrame();
}

TEST(Frame, FeedsAgainMoreAndLessAndNothing) {
  Host host(10);
  host.expectFrame();
  for (size_t count : {500, 1, 0, 64, 2000}) {
    // The first of two is forgotten.
    Items forgotten = makeItems(33, 9);
    ASSERT_TRUE(host.pipe.source(0, forgotten));
    host.items = makeItems(count, 10);
    ASSERT_TRUE(host.pipe.source(0, host.items));
    SCOPED_TRACE(count);
    host.expectFrame();
  }
}

TEST(Frame, ThePipelineOwnsABuffer) {
  Host host(200);
  ASSERT_TRUE(host.pipe.allocate("sums", 24));
  std::vector<int32_t> expected(24); // zeroed
  for (int frame = 0; frame < 2; ++frame) {
    expected = expectFrame(width, height, host.scale, host.table, expected,
                           host.items, host.finds)
                   .sums;
    EXPECT_RUNS(host.pipe);
    auto view = host.pipe.view<int32_t>("sums");
    EXPECT_EQ(std::vector<int32_t>(view.elements.begin(), view.elements.end()),
              expected);
  }
  // The host may write there, and take its own back.
  for (int32_t &sum : host.pipe.view<int32_t>("sums").elements)
    sum = 1;
  expected.assign(24, 1);
  expected = expectFrame(width, height, host.scale, host.table, expected,
                         host.items, host.finds)
                 .sums;
  EXPECT_RUNS(host.pipe);
  EXPECT_EQ(host.pipe.view<int32_t>("sums").elements[3], expected[3]);
  ASSERT_TRUE(host.pipe.buffer("sums", host.sums));
  host.expectFrame();
}

TEST(Frame, ViewsExistFromARunOn) {
  Host host(50);
  EXPECT_TRUE(host.pipe.view<Nearest>("nearest").elements.empty());
  EXPECT_TRUE(host.pipe.view<Item>("kept").elements.empty());
  host.expectFrame();
  auto first = host.pipe.view<Nearest>("nearest");
  EXPECT_EQ(first.extent[0], width);
  EXPECT_EQ(first.extent[1], height);
  // The same until the next run, and of the right type alone.
  EXPECT_EQ(host.pipe.view<Nearest>("nearest").elements.data(),
            first.elements.data());
  EXPECT_TRUE(host.pipe.view<Trace>("nearest").elements.empty());
  EXPECT_TRUE(host.pipe.view<Trace>("no such state").elements.empty());
}

TEST(Frame, CountsWhatStagesTakeAndGive) {
  Host host(123);
  EXPECT_RUNS(host.pipe);
  EXPECT_EQ(pikort_stats_runs(host.pipe.get()), 1);
  for (int32_t i = 0; i < pikort_stage_count(host.pipe.get()); ++i) {
    pikort_stage_stats stats;
    ASSERT_EQ(pikort_get_stage_stats(host.pipe.get(), i, &stats), PIKORT_OK);
    if (std::string(stats.name) == "count") {
      EXPECT_EQ(stats.in, 123);
      EXPECT_EQ(stats.out, 123);
    }
    if (std::string(stats.name) == "find") {
      EXPECT_EQ(stats.in, 70);
    }
  }
}

TEST(Frame, PipelinesRunAtTheSameTime) {
  std::optional<Host> hosts[3];
  for (unsigned i = 0; i < 3; ++i)
    hosts[i].emplace(150 * (i + 1), i);
  std::vector<std::thread> threads;
  for (std::optional<Host> &host : hosts)
    threads.emplace_back([&host] {
      for (int frame = 0; frame < 4; ++frame)
        host->expectFrame();
    });
  for (std::thread &thread : threads)
    thread.join();
}

TEST(Frame, PipelinesComeAndGo) {
  for (unsigned i = 0; i < 3; ++i) {
    Host first(20 + i, i), second(40, i);
    second.expectFrame();
    Pipeline moved = std::move(first.pipe);
    first.pipe = std::move(moved);
    first.expectFrame();
  }
}

} // namespace
