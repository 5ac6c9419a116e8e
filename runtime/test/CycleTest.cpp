// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CycleTest.cpp - Loops and rounds against the sequential meaning ----===//

#include "graph/Graph.h"

#include <functional>
#include <gtest/gtest.h>

using namespace piko::rt::test;

/// A stage of small bins, in about one of which a primitive falls.
static TestStage binned(std::vector<int> ports, int flags = 0) {
  TestStage stage;
  stage.bin[0] = stage.bin[1] = 4;
  stage.flags = PIKOIR_PLACED | flags;
  stage.spread = 2;
  stage.ports = std::move(ports);
  stage.mostEmissions = 3;
  return stage;
}

static TestStage whole(std::vector<int> ports, int flags = 0) {
  TestStage stage;
  stage.flags = flags;
  stage.ports = std::move(ports);
  return stage;
}

static Graph makeGraph(std::vector<TestStage> stages, std::vector<int> sources,
                       int64_t count = 300) {
  Graph graph;
  graph.stages = std::move(stages);
  graph.sources = std::move(sources);
  for (size_t s = 0; s < graph.sources.size(); ++s)
    graph.input.push_back(makeItems(count, s + 1));
  return graph;
}

// What leaves is in depth-first order, whatever the waves.
TEST(Cycle, SelfLoop) {
  Graph graph = makeGraph({binned({0, 1}), binned({})}, {0}, 3000);
  checkOrder(graph);
}

// Many hops for each primitive that leaves: the tree is flattened on the way.
TEST(Cycle, LongLoopsKeepTheOrder) {
  std::vector<int> ports(14, 0);
  ports.insert(ports.begin() + 7, {1, 2});
  Graph graph =
      makeGraph({whole(ports), whole({0, 2}), binned({})}, {0, 1}, 3000);
  graph.mostHops = 200;
  checkOrder(graph);
}

// Where the order of calls can be seen, they are made one by one.
TEST(Cycle, OrderedSelfLoop) {
  Graph graph = makeGraph({binned({1, 0, 0}, PIKOIR_ORDERED), binned({})}, {0});
  checkOrder(graph);
}

// Both stages take primitives from outside and send some out; these meet each
// other, a detour, and a source.
TEST(Cycle, ExitsJoinOtherEdges) {
  for (int flags : {0, int(PIKOIR_ORDERED)}) {
    Graph graph = makeGraph({binned({1, 2, 4}), binned({2, 3, 4}),
                             binned({1, 3, 4}, flags), binned({4}), binned({})},
                            {0, 1, 2, 4, 0});
    checkOrder(graph);
  }
}

// A loop feeds another: the first one's exits are the second one's roots.
TEST(Cycle, LoopAfterLoop) {
  Graph graph = makeGraph(
      {binned({1, 0, 2}), binned({1, 2}), binned({2, 3}), whole({})}, {0, 1});
  checkOrder(graph);
}

// Lists run in rounds; empty bins are called in the first one only.
TEST(Cycle, Rounds) {
  TestStage list = binned({1, 2}, PIKOIR_LIST);
  list.everyBin = true;
  list.batch = 7;
  Graph graph =
      makeGraph({list, binned({0, 2, 1}), binned({}, PIKOIR_COLLECTS)}, {0, 1});
  checkOrder(graph);
}

// Two stages that collect take turns, with loops and plain stages between.
TEST(Cycle, RoundsOfSeveralStages) {
  Graph graph = makeGraph({binned({1, 5}, PIKOIR_LIST), binned({2, 1, 3}),
                           whole({3, 4}), binned({4, 0}, PIKOIR_COLLECTS),
                           binned({0, 5}, PIKOIR_ORDERED), binned({})},
                          {1, 0, 3, 5}, 100);
  checkOrder(graph);
}

// A stage that waits starts a later lineage than the one that it waits for.
TEST(Cycle, WaitsDecideTheOrder) {
  Graph graph = makeGraph(
      {whole({2}, PIKOIR_COLLECTS), whole({2}, PIKOIR_COLLECTS), whole({})},
      {0, 1});
  checkOrder(graph);
  std::vector<Arrivals> first = graph.arrivals;
  graph.stages[0].waits = {1};
  checkOrder(graph);
  EXPECT_NE(graph.arrivals[2].buckets, first[2].buckets);
}

/// How often the kernels of a graph's stages ran, and on several threads.
static pikort_kernel_stats sumLaunches(pikort_pipeline *p) {
  pikort_kernel_stats sum{};
  for (int32_t k = 0; k < pikort_kernel_count(p); ++k) {
    pikort_kernel_stats stats;
    EXPECT_EQ(pikort_get_kernel_stats(p, k, &stats), PIKORT_OK);
    sum.launches += stats.launches;
    sum.parallel_launches += stats.parallel_launches;
  }
  return sum;
}

/// Runs a cycle of few primitives on many threads.
static void runFew(std::vector<TestStage> stages) {
  for (TestStage &stage : stages)
    stage.mostEmissions = 1;
  Graph graph = makeGraph(std::move(stages), {0}, 12);
  graph.alwaysEmits = true;
  graph.mostHops = 200;
  checkOrder(graph);
  graph.logs = false;
  GraphRun run(graph);
  ASSERT_EQ(run.run(7), PIKORT_OK) << pikort_message(run.get());
  pikort_kernel_stats sum = sumLaunches(run.get());
  EXPECT_GE(sum.launches, 200);
  EXPECT_EQ(sum.parallel_launches, 0);
}

// What is in a wave is too little for threads, however many bins there are.
TEST(Cycle, FewPrimitivesTakeNoThreads) {
  runFew({whole({0})});
  runFew({whole({1}), whole({0})});
  runFew({whole({0}, PIKOIR_ORDERED)});
  runFew({whole({1}), whole({0}, PIKOIR_LIST)});
  runFew({whole({0}, PIKOIR_COLLECTS)});
}

// Many primitives do take them.
TEST(Cycle, ManyPrimitivesTakeThreads) {
  Graph graph = makeGraph({whole({0}, PIKOIR_SPLIT)}, {0}, 20000);
  graph.alwaysEmits = true;
  graph.logs = false;
  graph.stages[0].mostEmissions = 1;
  GraphRun run(graph);
  ASSERT_EQ(run.run(2), PIKORT_OK) << pikort_message(run.get());
  pikort_kernel_stats sum = sumLaunches(run.get());
  EXPECT_EQ(sum.launches, graph.mostHops + 1);
  EXPECT_EQ(sum.parallel_launches, sum.launches);
}

// Bins without primitives cost nothing: a launch that shows them all to the
// kernel has many units, one that does not has few.
TEST(Cycle, FewPrimitivesInManyBins) {
  TestStage stage = binned({0, 1});
  stage.bin[0] = stage.bin[1] = 1;
  TestStage list = stage;
  list.flags |= PIKOIR_LIST;
  list.ports = {0, 1, 1};
  for (TestStage &loop : {std::ref(stage), std::ref(list)}) {
    Graph graph = makeGraph({loop, binned({})}, {0}, 9);
    graph.domain[0] = graph.domain[1] = 300;
    graph.mostHops = 40;
    checkOrder(graph);
  }
}

// --- Errors -----------------------------------------------------------------

/// Runs a loop without end under a limit; returns the message.
static std::string runEndless(std::vector<TestStage> stages, int64_t limit) {
  for (TestStage &stage : stages)
    stage.mostEmissions = 1;
  Graph graph = makeGraph(std::move(stages), {0}, 50);
  graph.mostHops = INT_MAX;
  graph.alwaysEmits = true;
  GraphRun run(graph);
  EXPECT_EQ(pikort_set_loop_limit(run.get(), limit), PIKORT_OK);
  std::string message;
  for (int threads : {1, 3}) {
    EXPECT_EQ(run.run(threads), PIKORT_ENDLESS);
    EXPECT_TRUE(message.empty() || message == pikort_message(run.get()));
    message = pikort_message(run.get());
  }
  return message;
}

TEST(Cycle, HopsAreLimited) {
  EXPECT_EQ(runEndless({whole({0})}, 5),
            "stage 's0', bin 0: a loop did not end within 5 hops");
  EXPECT_EQ(runEndless({whole({1}), whole({0})}, 0),
            "stage 's1', bin 0: a loop did not end within 0 hops");
  EXPECT_EQ(runEndless({whole({0}, PIKOIR_ORDERED)}, 5),
            "stage 's0', bin 0: a loop did not end within 5 hops");
  // The first one in order is named, though waves go wide.
  TestStage everywhere = binned({0});
  everywhere.spread = 5;
  TestStage ordered = everywhere;
  ordered.flags |= PIKOIR_ORDERED;
  std::string message = runEndless({everywhere}, 3);
  EXPECT_EQ(message, runEndless({ordered}, 3));
  EXPECT_NE(message.find("a loop did not end within 3 hops"),
            std::string::npos);
}

TEST(Cycle, RoundsAreLimited) {
  EXPECT_EQ(runEndless({whole({1}), whole({0}, PIKOIR_LIST)}, 4),
            "stage 's1': a loop did not end within 4 rounds");
}

// A long loop costs memory for what is pending, not for its hops.
TEST(Cycle, LongLoopsStaySmall) {
  for (int flags : {0, int(PIKOIR_ORDERED)}) {
    TestStage stage = whole({0}, flags);
    stage.mostEmissions = 1;
    Graph graph = makeGraph({stage}, {0}, 40);
    graph.alwaysEmits = true;
    graph.mostHops = INT_MAX;
    graph.logs = false;
    GraphRun run(graph);
    pikort_set_loop_limit(run.get(), 5000);
    EXPECT_EQ(run.run(2), PIKORT_ENDLESS);
    int64_t bytes = pikort_peak_bytes(run.get());
    pikort_set_loop_limit(run.get(), 50);
    pikort_reset_stats(run.get());
    EXPECT_EQ(run.run(2), PIKORT_ENDLESS);
    EXPECT_LT(bytes, 4 * pikort_peak_bytes(run.get()) + (2 << 20));
  }
}

/// What the program does wrong.
enum class Wrong { NoLoop, NoCycle, NoPart, NoStep, TwoSteps, TooEarly };
static Wrong wrong;

static void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Wrong", 1);
  pikoir_declare_record(p, 0, "Item", 8, 8);
  pikoir_declare_field(p, 0, "id", PIKORT_I64, 0, 1, 0);
  for (int32_t s = 0; s < 3; ++s)
    pikoir_declare_stage(p, s, ("s" + std::to_string(s)).c_str(), 0, nullptr, 0,
                         0, 0, 0);
  pikoir_declare_source(p, 0, 0);
  pikoir_declare_edge(p, 0, 0, 1);
  pikoir_declare_edge(p, 1, 0, 1);
  pikoir_declare_edge(p, 1, 1, 2);
  int32_t cycle = 1;
  pikoir_declare_cycle(p, 0, &cycle, 1);
  pikoir_declare_loop(p, 0, &cycle, 1, 0);
}

static int32_t run(pikort_pipeline *p) {
  auto launch = [&](int32_t stage) {
    if (!pikoir_begin(p, stage))
      return pikoir_status(p);
    pikoir_writer *w = pikoir_open(p, stage, 0);
    if (stage == 0)
      *reinterpret_cast<int64_t *>(pikoir_append(w, 0)) = 1;
    pikoir_next(w);
    pikoir_close(w);
    return pikoir_end(p, stage);
  };
  if (int32_t status = launch(0))
    return status;
  switch (wrong) {
  case Wrong::NoLoop:
    EXPECT_EQ(pikoir_loop_step(p, 1), -1);
    break;
  case Wrong::NoCycle:
    EXPECT_EQ(pikoir_cycle_turn(p, -1), -1);
    break;
  case Wrong::NoPart:
    EXPECT_EQ(pikoir_cycle_takes(p, 1), 0);
    break;
  case Wrong::NoStep:
    return launch(1);
  case Wrong::TwoSteps:
    EXPECT_EQ(pikoir_loop_step(p, 0), 1);
    EXPECT_EQ(pikoir_loop_step(p, 0), -1);
    EXPECT_EQ(pikoir_loop_step(p, 99), -1); // the first error is kept
    break;
  case Wrong::TooEarly:
    EXPECT_EQ(pikoir_loop_step(p, 0), 1);
    if (int32_t status = launch(1))
      return status;
    return launch(2);
  }
  return pikoir_status(p);
}

TEST(Cycle, WrongPrograms) {
  pikort_program program{PIKORT_ABI_VERSION, "Wrong", setup, run};
  pikort_pipeline *p = nullptr;
  ASSERT_EQ(pikort_create(&program, &p), PIKORT_OK) << pikort_message(p);
  int64_t extent = 4, item = 1;
  pikort_set_domain(p, 1, &extent);
  pikort_bind_source(p, 0, &item, 1, 8);
  auto expect = [&](Wrong what, const char *text) {
    wrong = what;
    EXPECT_EQ(pikort_run(p), PIKORT_BAD_PROGRAM);
    EXPECT_STREQ(pikort_message(p), text);
  };
  expect(Wrong::NoLoop, "expected the number of a loop, but got 1");
  expect(Wrong::NoCycle, "expected the number of a cycle, but got -1");
  expect(Wrong::NoPart,
         "expected a stage between the loops of a cycle, but got 1");
  expect(Wrong::NoStep,
         "stage 's1': expected a step of its cycle to name it first");
  expect(Wrong::TwoSteps, "stage 's1': expected its kernel to run before the "
                          "next step of its cycle");
  expect(Wrong::TooEarly, "stage 's2': expected stage 's1' to run before it");
  pikort_destroy(p);
}
