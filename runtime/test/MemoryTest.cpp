// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- MemoryTest.cpp - Reuse of memory, and running out of it ------------===//

#include "graph/Graph.h"

#include <gtest/gtest.h>

using namespace piko::rt::test;

/// Binned and joined stages with a fan-in: every kind of array is used.
static Graph makeGraph(int64_t items) {
  TestStage binned;
  binned.bin[0] = binned.bin[1] = 4;
  binned.flags = PIKOIR_PLACED | PIKOIR_SPLIT;
  binned.ports = {1, 2};
  TestStage middle = binned;
  middle.ports = {2};
  TestStage last = binned;
  last.flags |= PIKOIR_COLLECTS;
  last.tile = 2;
  last.ports = {3};
  TestStage drain;
  Graph graph;
  graph.stages = {binned, middle, last, drain};
  graph.sources = {0};
  graph.input.resize(1);
  graph.input[0].resize(static_cast<size_t>(items));
  for (size_t i = 0; i < graph.input[0].size(); ++i)
    graph.input[0][i] = {mix(9, i)};
  return graph;
}

/// Two loops, one of them in rounds, and lists with reordered emissions.
static Graph makeCyclicGraph() {
  Graph graph = makeGraph(200);
  for (TestStage &stage : graph.stages)
    stage.spread = 2;
  graph.stages[0].ports = {0, 1};
  graph.stages[1].ports = {1, 2};
  graph.stages[1].flags |= PIKOIR_ORDERED;
  graph.stages[2].tile = 0;
  graph.stages[2].flags |= PIKOIR_LIST;
  graph.stages[2].reordered = true;
  graph.stages[2].ports = {3, 1};
  graph.mostHops = 6;
  return graph;
}

TEST(Memory, DoesNotGrowFromFrameToFrame) {
  for (int threads : {1, 2}) {
    Graph graph = makeGraph(10000);
    GraphRun run(graph);
    for (int frame = 0; frame < 5; ++frame)
      ASSERT_EQ(run.run(threads), PIKORT_OK);
    int64_t reserved = pikort_reserved_bytes(run.get());
    int64_t peak = pikort_peak_bytes(run.get());
    for (int frame = 0; frame < 40; ++frame)
      ASSERT_EQ(run.run(threads), PIKORT_OK);
    // Threads share the work differently each time, by some blocks.
    double slack = threads == 1 ? 1.0 : 1.5;
    EXPECT_LE(static_cast<double>(pikort_reserved_bytes(run.get())),
              static_cast<double>(reserved) * slack);
    EXPECT_LE(static_cast<double>(pikort_peak_bytes(run.get())),
              static_cast<double>(peak) * slack);
  }
}

TEST(Memory, GivesBackWhatSmallerFramesDoNotNeed) {
  Graph graph = makeGraph(50000);
  GraphRun run(graph);
  ASSERT_EQ(run.run(2), PIKORT_OK);
  int64_t large = pikort_reserved_bytes(run.get());
  ASSERT_EQ(
      pikort_bind_source(run.get(), 0, graph.input[0].data(), 50, sizeof(Item)),
      PIKORT_OK);
  for (int frame = 0; frame < 20; ++frame)
    ASSERT_EQ(run.run(2), PIKORT_OK);
  EXPECT_LT(pikort_reserved_bytes(run.get()), large / 4);
}

// Whatever allocation is refused, the run ends with a status, and the next run
// with enough memory gives the right result.
static void runOut(Graph graph, int64_t steps) {
  std::vector<Arrivals> expected = graph.model();
  graph.normalise(expected);
  GraphRun run(graph);
  ASSERT_EQ(run.run(1), PIKORT_OK);
  int64_t enough = pikort_reserved_bytes(run.get());
  int failures = 0;
  for (int threads : {1, 2})
    for (int64_t limit = 4096; limit < enough; limit += enough / steps) {
      ASSERT_EQ(pikort_set_memory_limit(run.get(), limit), PIKORT_OK);
      int32_t status = run.run(threads);
      ASSERT_TRUE(status == PIKORT_OK || status == PIKORT_OUT_OF_MEMORY)
          << status << ": " << pikort_message(run.get());
      if (status == PIKORT_OUT_OF_MEMORY) {
        ++failures;
        EXPECT_NE(std::string(pikort_message(run.get()))
                      .find("but the limit is " + std::to_string(limit)),
                  std::string::npos)
            << pikort_message(run.get());
      }
      EXPECT_LE(pikort_reserved_bytes(run.get()), limit);
    }
  EXPECT_GT(failures, steps / 2);
  ASSERT_EQ(pikort_set_memory_limit(run.get(), 0), PIKORT_OK);
  ASSERT_EQ(run.run(2), PIKORT_OK);
  graph.normalise(graph.arrivals);
  EXPECT_EQ(graph.arrivals, expected);
}

TEST(Memory, RunsOutAnywhere) { runOut(makeGraph(3000), 200); }
TEST(Memory, RunsOutAnywhereInCycles) { runOut(makeCyclicGraph(), 100); }
