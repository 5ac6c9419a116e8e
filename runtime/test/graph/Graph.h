// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Graph.h - Test pipelines, and what they mean -----------------------===//
//
// A Graph is a pipeline whose stages do what a hash of their input says: how
// much is emitted, to which ports, into which buckets. It runs in two ways:
//
//   model()  the meaning: recursive and sequential, as docs/Language.md has it;
//   run()    through the ABI, with kernels like those the compiler makes.
//
// Both log what reaches every stage, in order; tests compare the logs.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_TEST_GRAPH_H
#define PIKO_RUNTIME_TEST_GRAPH_H

#include "pikort/abi.h"

#include <cstdint>
#include <set>
#include <string>
#include <vector>

namespace piko::rt::test {

/// A primitive. It has padding, which must come out as zero.
struct Item {
  uint64_t id = 0;
  uint8_t hops = 0;
  uint64_t check = ~id;
};

struct TestStage {
  int64_t bin[2] = {0, 0};
  int flags = 0;
  int64_t tile = 0; ///< Owner tiles.
  int64_t split = 0;
  int schedule = PIKOIR_LOAD_BALANCE;
  int64_t batch = 0;      ///< Of lists; 0 = the whole list.
  bool everyBin = false;  ///< Of lists.
  bool perBin = false;    ///< The schedule depends on the bin.
  bool reordered = false; ///< Emits from iterations that take turns.
  std::vector<int> ports; ///< Consumer of each port.
  std::vector<int> waits; ///< Stages that it waits for.
  int spread = 3;         ///< Most places of one primitive, plus one.
  int mostEmissions = 2;  ///< Of one call.
  int64_t runLength = 0;  ///< If not 0: ids in runs share a bucket, swapped.
};

/// Stages on a common cycle, or one stage.
struct TestComponent {
  std::vector<int> stages;
  bool cyclic = false;
};

/// What a compiler would plan for a graph, and declare.
struct TestPlan {
  /// Stages that run together: a loop, or one that is on none.
  struct Part {
    std::vector<int> stages;
    bool isLoop = false;
    int keys = 0; ///< Of what comes into a loop.
  };
  std::vector<Part> parts; ///< Loops first.
  std::vector<int> partOf; ///< Of each stage.
  std::vector<int> roots, keeps;
  std::vector<std::vector<int>> keys; ///< Of each port.

  int loopCount() const;
};

/// What reached a stage.
struct Arrivals {
  std::vector<uint64_t> items;                ///< In any order.
  std::vector<std::vector<uint64_t>> buckets; ///< In each bucket, in order.
  std::vector<uint64_t> calls; ///< Of lists: a hash of each, in order.
  bool operator==(const Arrivals &) const = default;
};

struct Graph {
  int64_t domain[2] = {20, 13};
  std::vector<TestStage> stages;
  std::vector<int> sources; ///< Stage of each source.
  std::vector<std::vector<Item>> input;
  int mostHops = 8;         ///< Primitives that have made so many emit nothing.
  bool alwaysEmits = false; ///< As much as a call can.
  bool logs = true;         ///< Runs note arrivals.
  bool strips = false;      ///< Stages that can run in strips do.

  // Filled by the runs.
  std::vector<Arrivals> arrivals;
  bool paddingSeen = false;

  int64_t tiles(int stage) const;
  int64_t buckets(int stage) const;
  /// The places of an item in a stage, in the order in which they are named;
  /// with repetitions.
  std::vector<int64_t> places(int stage, const Item &item) const;
  /// The primitives that a call emits: port and item.
  std::vector<std::pair<int, Item>> emissions(int stage, uint64_t seed,
                                              int hops) const;

  /// What the schedule says of a bin.
  int kindOf(int stage, int64_t bin) const;
  int64_t batchOf(int stage, int64_t bin) const;
  bool everyBinOf(int stage, int64_t bin) const;
  bool takesList(int stage) const { return stages[stage].flags & PIKOIR_LIST; }
  bool collects(int stage) const {
    return stages[stage].flags & (PIKOIR_LIST | PIKOIR_COLLECTS);
  }
  /// The stages on a common cycle with `stage`, of those that do not collect.
  std::vector<int> loopOf(int stage) const;
  /// Components in the order in which they run.
  std::vector<TestComponent> order() const;
  TestPlan plan() const;
  /// Where stripStages() of a source begin, and end, in order().
  std::pair<size_t, size_t> stripRange(int source) const;
  /// The stages that can take a source in strips.
  std::vector<int> stripStages(int source) const;
  /// What tests may compare: a loop's stages take their primitives in any
  /// order, unless that can be seen; then only that in each bucket is compared.
  void normalise(std::vector<Arrivals> &arrivals) const;

  /// Runs the meaning; returns what reached each stage.
  std::vector<Arrivals> model() const;
  /// A graph of `stageCount` stages drawn from `seed`.
  static Graph random(uint64_t seed, int stageCount, int64_t items);
  /// The same with edges to earlier stages.
  static Graph randomCyclic(uint64_t seed, int stageCount, int64_t items);
};

uint64_t mix(uint64_t a, uint64_t b);
std::vector<Item> makeItems(int64_t count, uint64_t seed = 1);

/// A pipeline that runs a graph through the ABI. One at a time.
class GraphRun {
public:
  explicit GraphRun(Graph &graph);
  ~GraphRun();
  GraphRun(const GraphRun &) = delete;
  GraphRun &operator=(const GraphRun &) = delete;
  pikort_pipeline *get() const { return pipeline_; }
  int32_t run(int threads);

private:
  pikort_pipeline *pipeline_ = nullptr;
};

/// Runs a graph on 1, 2 and 7 threads, and compares with its meaning; if the
/// graph has strips, with strips of so many primitives.
void checkOrder(Graph &graph, int64_t stripSize = 0);
/// Compares what the latest run noted.
void checkArrivals(Graph &graph, const std::vector<Arrivals> &expected,
                   const std::string &what);

} // namespace piko::rt::test

#endif // PIKO_RUNTIME_TEST_GRAPH_H
