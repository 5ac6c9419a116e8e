// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- OrderTest.cpp - Lineage order against the sequential meaning -------===//

#include "graph/Graph.h"

#include <algorithm>
#include <gtest/gtest.h>

using namespace piko::rt::test;

static Graph chain(int64_t count, std::vector<TestStage> stages) {
  Graph graph;
  for (size_t s = 0; s + 1 < stages.size(); ++s)
    stages[s].ports = {static_cast<int>(s) + 1};
  graph.stages = std::move(stages);
  graph.sources = {0};
  graph.input = {makeItems(count)};
  return graph;
}

// Whole-domain bins: units are concatenated.
TEST(Order, Concatenates) {
  TestStage stage;
  stage.flags = PIKOIR_SPLIT;
  Graph graph = chain(20000, {stage, stage, stage});
  checkOrder(graph);
}

// A bin's positions are not in emission order: counts are permuted back.
TEST(Order, PermutesBackByItem) {
  TestStage binned;
  binned.bin[0] = binned.bin[1] = 4;
  binned.flags = PIKOIR_PLACED | PIKOIR_SPLIT;
  TestStage whole;
  Graph graph = chain(20000, {binned, binned, binned, whole});
  checkOrder(graph);
}

// Every primitive in just one bucket takes the shorter way.
TEST(Order, PermutesSinglePlaces) {
  TestStage binned;
  binned.bin[0] = binned.bin[1] = 4;
  binned.flags = PIKOIR_PLACED;
  binned.spread = 1;
  TestStage whole;
  Graph graph = chain(20000, {binned, binned, binned, whole});
  checkOrder(graph);
}

// Each chunk of the count is sorted by bucket, but the chunks are not.
TEST(Order, SortedInPieces) {
  TestStage runs;
  runs.bin[0] = 4;
  runs.flags = PIKOIR_PLACED;
  runs.runLength = 4096;
  Graph graph = chain(16384, {runs, TestStage(), TestStage()});
  for (size_t i = 0; i < graph.input[0].size(); ++i)
    graph.input[0][i] = {i};
  checkOrder(graph);
}

// Tiles of one bin are merged back by item.
TEST(Order, MergesTilesOfCollectingStages) {
  TestStage first;
  first.bin[0] = first.bin[1] = 8;
  first.flags = PIKOIR_PLACED;
  TestStage tiled = first;
  tiled.flags |= PIKOIR_COLLECTS;
  tiled.tile = 2;
  Graph graph = chain(20000, {first, tiled, tiled, first});
  checkOrder(graph);
}

// A stage that processes lists calls pikoir_next once for each bucket, for
// empty buckets too; its emissions meet others in a join, so they need keys.
TEST(Order, ListsJoinWithPrimitives) {
  TestStage list;
  list.bin[0] = list.bin[1] = 3;
  list.flags = PIKOIR_PLACED | PIKOIR_LIST;
  list.everyBin = true;
  list.ports = {2, 1};
  list.mostEmissions = 4;
  TestStage middle;
  middle.ports = {2};
  TestStage last;
  last.flags = PIKOIR_PLACED;
  last.bin[0] = 4;
  Graph graph;
  graph.stages = {list, middle, last};
  graph.sources = {0, 2, 1};
  graph.input = {makeItems(9), makeItems(50, 2), makeItems(70, 3)};
  checkOrder(graph);
}

// Two branches of one stage join: the ordinals over all ports decide.
TEST(Order, JoinsBranches) {
  TestStage split;
  split.bin[0] = 8;
  split.flags = PIKOIR_PLACED;
  split.ports = {1, 2, 3};
  split.mostEmissions = 5;
  TestStage branch = split;
  branch.ports = {3};
  branch.mostEmissions = 2;
  TestStage join = branch;
  join.ports = {};
  Graph graph;
  graph.stages = {split, branch, branch, join};
  graph.sources = {0};
  graph.input = {makeItems(5000)};
  checkOrder(graph);
}

TEST(Order, RandomGraphs) {
  for (uint64_t seed = 0; seed < 150; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Graph graph = Graph::random(seed, 1 + static_cast<int>(seed % 7),
                                seed % 5 == 0 ? 1500 : 120);
    checkOrder(graph);
    if (HasFatalFailure())
      return;
  }
}

TEST(Order, RandomCyclicGraphs) {
  for (uint64_t seed = 0; seed < 250; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Graph graph = Graph::randomCyclic(seed, 1 + static_cast<int>(seed % 7),
                                      seed % 7 == 0 ? 100 : 20);
    checkOrder(graph);
    if (HasFatalFailure())
      return;
  }
}

TEST(Order, NoPrimitives) {
  TestStage binned;
  binned.bin[0] = binned.bin[1] = 4;
  binned.flags = PIKOIR_PLACED | PIKOIR_COLLECTS;
  TestStage whole;
  Graph graph = chain(0, {binned, whole, binned});
  checkOrder(graph);
}

// The same multiset, in any order.
TEST(Order, UnorderedKeepsTheMultiset) {
  TestStage binned;
  binned.bin[0] = binned.bin[1] = 4;
  binned.flags = PIKOIR_PLACED | PIKOIR_UNORDERED;
  TestStage last = binned;
  Graph graph = chain(20000, {binned, binned, last});
  std::vector<Arrivals> expected = graph.model();
  GraphRun run(graph);
  for (int threads : {1, 2, 7}) {
    ASSERT_EQ(run.run(threads), PIKORT_OK);
    for (size_t s = 0; s < expected.size(); ++s) {
      auto want = expected[s].items, got = graph.arrivals[s].items;
      std::sort(want.begin(), want.end());
      std::sort(got.begin(), got.end());
      EXPECT_EQ(got, want);
    }
  }
}

// A record whose buckets do not fit into one block of the log, named downwards.
TEST(Order, ManyBucketsOfOnePrimitive) {
  TestStage first;
  TestStage fine;
  fine.bin[0] = fine.bin[1] = 1;
  fine.flags = PIKOIR_PLACED;
  fine.spread = 100;
  Graph graph = chain(3000, {first, fine, first});
  graph.domain[0] = 300;
  graph.domain[1] = 200;
  checkOrder(graph);
}
