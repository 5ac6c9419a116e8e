// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- StripsTest.cpp - Sources in strips, and memory budgets -------------===//

#include "graph/Graph.h"

#include "pikort/pikort.h"

#include <gtest/gtest.h>

using namespace piko::rt::test;

/// A stage that makes much of little, one that writes, and a list of what is
/// left.
static Graph makeGraph(int64_t count) {
  TestStage first, second, list;
  first.flags = PIKOIR_SPLIT;
  first.ports = {1};
  second.flags = PIKOIR_PLACED | PIKOIR_ORDERED | PIKOIR_WRITES;
  second.bin[0] = 0;
  second.tile = 4;
  second.ports = {2};
  list.flags = PIKOIR_PLACED | PIKOIR_LIST;
  list.bin[0] = list.bin[1] = 4;
  Graph graph;
  graph.stages = {first, second, list};
  graph.stages[0].mostEmissions = 40;
  graph.stages[1].mostEmissions = 1;
  graph.sources = {0};
  graph.input = {makeItems(count)};
  graph.strips = true;
  return graph;
}

static int64_t launches(const GraphRun &run, const std::string &name) {
  for (int32_t k = 0; k < pikort_kernel_count(run.get()); ++k) {
    pikort_kernel_stats stats;
    pikort_get_kernel_stats(run.get(), k, &stats);
    if (stats.name == name)
      return stats.launches;
  }
  return -1;
}

static pikort_stage_stats statsOf(const GraphRun &run, int32_t stage) {
  pikort_stage_stats stats{};
  pikort_get_stage_stats(run.get(), stage, &stats);
  return stats;
}

// Strips of any size change nothing, whatever the graph.
TEST(Strips, KeepLineage) {
  int divided = 0;
  for (uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Graph graph = Graph::random(seed, 2 + static_cast<int>(seed % 5), 40);
    graph.strips = true;
    for (size_t i = 0; i < graph.sources.size(); ++i)
      divided += graph.stripStages(static_cast<int>(i)).size() > 1;
    for (int64_t size : {1, 7, 1000})
      checkOrder(graph, size);
    if (HasFatalFailure())
      return;
  }
  EXPECT_GT(divided, 15);
}

TEST(Strips, KeepLineageInLoops) {
  int loops = 0;
  for (uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Graph graph = Graph::randomCyclic(seed, 2 + static_cast<int>(seed % 4), 30);
    graph.strips = true;
    for (size_t i = 0; i < graph.sources.size(); ++i)
      for (int stage : graph.stripStages(static_cast<int>(i)))
        loops += !graph.loopOf(stage).empty();
    checkOrder(graph, 7);
    if (HasFatalFailure())
      return;
  }
  EXPECT_GT(loops, 30);
}

// Launches are counted for each strip; primitives as if there were none.
TEST(Strips, SumStatistics) {
  Graph graph = makeGraph(1000);
  GraphRun run(graph);
  ASSERT_EQ(run.run(2), PIKORT_OK);
  pikort_stage_stats whole = statsOf(run, 1);
  EXPECT_EQ(launches(run, "s0"), 1);
  pikort_reset_stats(run.get());
  ASSERT_EQ(pikort_set_strip_size(run.get(), 10), PIKORT_OK);
  ASSERT_EQ(run.run(2), PIKORT_OK);
  EXPECT_EQ(launches(run, "s0"), 100);
  EXPECT_EQ(launches(run, "s1"), 100);
  EXPECT_EQ(launches(run, "s2"), 1);
  EXPECT_EQ(statsOf(run, 1).in, whole.in);
  EXPECT_EQ(statsOf(run, 1).placed, whole.placed);
  EXPECT_EQ(statsOf(run, 1).out, whole.out);
}

TEST(Strips, EmptySources) {
  Graph graph = makeGraph(0);
  checkOrder(graph, 3);
}

// The budget holds, no primitive is seen twice, and strips are counted once
// however often they were taken back.
TEST(Strips, KeepABudget) {
  Graph graph = makeGraph(20000);
  graph.stages[2].flags = 0; // nothing is collected
  graph.stages[2].bin[0] = graph.stages[2].bin[1] = 0;
  std::vector<Arrivals> expected = graph.model();
  graph.normalise(expected);
  GraphRun run(graph);
  ASSERT_EQ(run.run(1), PIKORT_OK);
  int64_t whole = pikort_peak_bytes(run.get());
  pikort_stage_stats once = statsOf(run, 1);
  for (int threads : {1, 2, 7})
    for (int64_t budget : {int64_t(4) << 20, int64_t(6) << 20}) {
      ASSERT_EQ(pikort_set_memory_budget(run.get(), budget), PIKORT_OK);
      pikort_reset_stats(run.get());
      ASSERT_EQ(run.run(threads), PIKORT_OK) << pikort_message(run.get());
      checkArrivals(graph, expected, std::to_string(budget) + " bytes");
      EXPECT_LE(pikort_peak_bytes(run.get()), budget);
      EXPECT_LT(pikort_peak_bytes(run.get()), whole);
      EXPECT_GE(launches(run, "s1"), 10);
      EXPECT_EQ(statsOf(run, 1).in, once.in);
    }
}

// The first primitives make nothing, the last ones much: strips that have grown
// are taken back.
TEST(Strips, AreTakenBack) {
  Graph graph = makeGraph(20000);
  graph.stages[2].flags = 0;
  graph.stages[2].bin[0] = graph.stages[2].bin[1] = 0;
  for (size_t i = 0; i < 15000; ++i)
    graph.input[0][i].hops = static_cast<uint8_t>(graph.mostHops);
  std::vector<Arrivals> expected = graph.model();
  graph.normalise(expected);
  GraphRun run(graph);
  int64_t budget = int64_t(4) << 20;
  ASSERT_EQ(pikort_set_memory_budget(run.get(), budget), PIKORT_OK);
  ASSERT_EQ(run.run(2), PIKORT_OK) << pikort_message(run.get());
  checkArrivals(graph, expected, "taken back");
  EXPECT_LE(pikort_peak_bytes(run.get()), budget);
  EXPECT_GT(launches(run, "s0"), launches(run, "s1")); // some in vain
}

// Strips do not help where all must be there at once.
TEST(Strips, ListsOverABudget) {
  Graph graph = makeGraph(3000);
  graph.stages[1].mostEmissions = 40;
  GraphRun run(graph);
  ASSERT_EQ(pikort_set_memory_budget(run.get(), 4 << 20), PIKORT_OK);
  EXPECT_EQ(run.run(2), PIKORT_OUT_OF_MEMORY);
  std::string message = pikort_message(run.get());
  EXPECT_EQ(
      message.rfind("stage 's2': out of memory: what it collects takes ", 0),
      0u)
      << message;
  EXPECT_NE(
      message.find(" bytes in bins, and strips need 1048576 more, but the "
                   "budget is 4194304"),
      std::string::npos)
      << message;
  ASSERT_EQ(pikort_set_memory_budget(run.get(), 0), PIKORT_OK);
  EXPECT_EQ(run.run(2), PIKORT_OK) << pikort_message(run.get());
}

TEST(Strips, BudgetsThatOnePrimitiveExceeds) {
  Graph graph = makeGraph(100);
  GraphRun run(graph);
  ASSERT_EQ(pikort_set_memory_budget(run.get(), 4096), PIKORT_OK);
  EXPECT_EQ(run.run(2), PIKORT_OUT_OF_MEMORY);
  EXPECT_EQ(std::string(pikort_message(run.get())).rfind("stage 's0': ", 0), 0u)
      << pikort_message(run.get());
  EXPECT_EQ(pikort_set_memory_budget(run.get(), -1), PIKORT_INVALID_ARGUMENT);
  EXPECT_EQ(pikort_set_strip_size(run.get(), -1), PIKORT_INVALID_ARGUMENT);
}
