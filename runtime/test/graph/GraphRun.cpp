// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- GraphRun.cpp - Test pipelines through the ABI ----------------------===//

#include "graph/Graph.h"
#include "pikort/emission.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <gtest/gtest.h>

using namespace piko::rt::test;

static Graph *current = nullptr;
static TestPlan plan; ///< Of it.

/// Joins, roots and cycles.
static void declarePlan(pikort_pipeline *p) {
  plan = current->plan();
  for (size_t s = 0; s < current->stages.size(); ++s) {
    auto id = static_cast<int32_t>(s);
    const TestStage &stage = current->stages[s];
    pikoir_declare_root(p, id, plan.roots[s]);
    pikoir_declare_keys(p, id, plan.keeps[s]);
    for (size_t port = 0; port < stage.ports.size(); ++port) {
      bool unordered =
          (stage.flags | current->stages[stage.ports[port]].flags) &
          PIKOIR_UNORDERED;
      pikoir_declare_join(p, id, static_cast<int32_t>(port),
                          unordered ? PIKOIR_CONCATENATE : PIKOIR_PERMUTE,
                          plan.keys[s][port]);
    }
  }
  int32_t cycles = 0, loops = 0;
  for (const TestComponent &component : current->order())
    if (component.cyclic)
      pikoir_declare_cycle(p, cycles++, component.stages.data(),
                           static_cast<int32_t>(component.stages.size()));
  for (const TestPlan::Part &part : plan.parts)
    if (part.isLoop)
      pikoir_declare_loop(p, loops++, part.stages.data(),
                          static_cast<int32_t>(part.stages.size()), part.keys);
}

static void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Graph", 2);
  pikoir_declare_record(p, 0, "Item", sizeof(Item), alignof(Item));
  pikoir_declare_field(p, 0, "id", PIKORT_I64, offsetof(Item, id), 1, 0);
  pikoir_declare_field(p, 0, "hops", PIKORT_I8, offsetof(Item, hops), 1, 0);
  for (size_t s = 0; s < current->stages.size(); ++s) {
    const TestStage &stage = current->stages[s];
    auto id = static_cast<int32_t>(s);
    pikoir_declare_stage(p, id, ("s" + std::to_string(s)).c_str(), 0, stage.bin,
                         stage.schedule, stage.split, stage.flags, stage.tile);
    if (stage.flags & PIKOIR_LIST)
      pikoir_declare_schedule(p, id, stage.batch, stage.everyBin);
    for (int waitedFor : stage.waits)
      pikoir_declare_wait(p, id, waitedFor);
    for (size_t port = 0; port < stage.ports.size(); ++port)
      pikoir_declare_edge(p, id, static_cast<int32_t>(port), stage.ports[port]);
  }
  for (size_t i = 0; i < current->sources.size(); ++i)
    pikoir_declare_source(p, static_cast<int32_t>(i), current->sources[i]);
  declarePlan(p);
  int32_t groups = 0;
  for (size_t i = 0; i < current->sources.size(); ++i)
    if (auto members = current->stripStages(static_cast<int>(i));
        !members.empty())
      pikoir_declare_strips(p, groups++, static_cast<int32_t>(i), 0,
                            members.data(),
                            static_cast<int32_t>(members.size()));
}

/// One emission, by the inline fast path or by calls.
static void write(pikoir_writer *w, int stage, int32_t port, const Item &item,
                  bool fast) {
  auto *room = reinterpret_cast<Item *>(fast ? pikoir_append_inline(w, port)
                                             : pikoir_append(w, port));
  room->id = item.id;
  room->hops = item.hops;
  room->check = item.check;
  int consumer = current->stages[stage].ports[port];
  if (current->stages[consumer].flags & PIKOIR_PLACED)
    for (int64_t bucket : current->places(consumer, item))
      fast ? pikoir_place_inline(w, port, bucket)
           : pikoir_place(w, port, bucket);
}

/// All emissions of a call, two from each iteration: first one from each, in
/// order, then, after a barrier, the other from each, in reverse.
static void writeReordered(pikoir_writer *w, int stage,
                           const std::vector<std::pair<int, Item>> &emissions) {
  auto count = static_cast<int64_t>(emissions.size());
  int64_t iterations = (count + 1) / 2;
  auto emit = [&](int64_t iteration, int64_t i) {
    pikoir_reorder_iteration(w, iteration);
    auto &[port, item] = emissions[static_cast<size_t>(i)];
    write(w, stage, port, item, i & 2);
  };
  pikoir_reorder_begin(w, iterations);
  for (int64_t i = 0; i < iterations; ++i)
    emit(i, 2 * i);
  for (int64_t i = iterations - 1; i >= 0; --i)
    if (2 * i + 1 < count)
      emit(i, 2 * i + 1);
  pikoir_reorder_end(w);
}

static uint64_t callSeed(const pikoir_input *in, const pikoir_call &call) {
  auto *items = reinterpret_cast<const Item *>(in->items);
  auto seed = static_cast<uint64_t>(call.bin);
  for (int64_t i = call.begin; i < call.end; ++i)
    seed = mix(seed, items[in->order ? in->order[i] : i].id);
  return seed;
}

static void runUnit(pikort_pipeline *p, int stage, const pikoir_input *in,
                    int64_t u) {
  const pikoir_unit &unit = in->units[u];
  const TestStage &s = current->stages[stage];
  auto *items = reinterpret_cast<const Item *>(in->items);
  bool fast = mix(static_cast<uint64_t>(stage), 3) & 1;
  pikoir_writer *w = pikoir_open(p, stage, u);
  auto emit = [&](uint64_t seed, int hops) {
    auto emissions = current->emissions(stage, seed, hops);
    if (s.reordered)
      writeReordered(w, stage, emissions);
    else
      for (auto &[port, item] : emissions)
        write(w, stage, port, item, fast);
    fast ? pikoir_next_inline(w) : pikoir_next(w);
  };
  int64_t bucket = unit.bucket_begin;
  for (int64_t i = unit.begin; i < unit.end && !in->calls; ++i) {
    while (in->offsets[bucket + 1] <= i)
      ++bucket;
    const Item &item = items[in->order ? in->order[i] : i];
    emit(mix(item.id, static_cast<uint64_t>(bucket)), item.hops);
  }
  for (; in->calls && bucket < unit.bucket_end; ++bucket) {
    const pikoir_call &call = in->calls[bucket];
    int hops = 0;
    for (int64_t i = call.begin; i < call.end; ++i)
      hops = std::max<int>(hops, items[in->order ? in->order[i] : i].hops);
    emit(callSeed(in, call), hops);
  }
  pikoir_close(w);
}

/// Notes what reached a stage, and checks that the input is well formed.
static void note(int stage, const pikoir_input *in) {
  Arrivals &log = current->arrivals[stage];
  auto *items = reinterpret_cast<const Item *>(in->items);
  EXPECT_EQ(in->tiles, current->tiles(stage));
  std::set<int64_t> seen;
  auto noteBuckets = [&](int64_t begin, int64_t end) {
    for (int64_t c = begin; c < end; ++c)
      for (int64_t i = in->offsets[c]; i < in->offsets[c + 1]; ++i) {
        int64_t item = in->order ? in->order[i] : i;
        seen.insert(item);
        log.buckets[static_cast<size_t>(c)].push_back(items[item].id);
        EXPECT_EQ(items[item].check, ~items[item].id);
        static const char zeros[7] = {};
        current->paddingSeen |=
            std::memcmp(&items[item].hops + 1, zeros, sizeof(zeros)) != 0;
      }
  };
  int64_t bucket =
      0; // up to which buckets are noted; several units may share one
  for (int64_t u = 0; u < in->unit_count && !in->calls; ++u) {
    noteBuckets(std::max(bucket, in->units[u].bucket_begin),
                in->units[u].bucket_end);
    bucket = in->units[u].bucket_end;
  }
  for (int64_t c = 0; c < in->call_count; ++c)
    if (c == 0 || in->calls[c].bin != in->calls[c - 1].bin) {
      int64_t tiles = in->tiles, bin = in->calls[c].bin;
      noteBuckets(bin * tiles, (bin + 1) * tiles);
    }
  for (int64_t item : seen)
    log.items.push_back(items[item].id);
  bool list = current->takesList(stage);
  EXPECT_EQ(in->calls != nullptr, list);
  int64_t position = 0, next = 0;
  for (int64_t u = 0; u < in->unit_count; ++u) {
    const pikoir_unit &unit = in->units[u];
    EXPECT_EQ(unit.begin, position);
    position = unit.end;
    if (list) {
      EXPECT_EQ(unit.bucket_begin, next);
      next = unit.bucket_end;
      EXPECT_EQ(in->calls[unit.bucket_begin].begin, unit.begin);
      EXPECT_EQ(in->calls[next - 1].end, unit.end);
      bool splits = (current->stages[stage].flags &
                     (PIKOIR_SPLIT | PIKOIR_ORDERED)) == PIKOIR_SPLIT;
      if (next < in->call_count && !splits)
        EXPECT_LT(in->calls[next - 1].bin, in->calls[next].bin);
      continue;
    }
    EXPECT_GE(unit.begin, in->offsets[unit.bucket_begin]);
    EXPECT_LE(unit.end, in->offsets[unit.bucket_end]);
    if (unit.bucket_end - unit.bucket_begin > 1 ||
        current->stages[stage].flags & PIKOIR_ORDERED) {
      EXPECT_EQ(unit.begin, in->offsets[unit.bucket_begin]);
      EXPECT_EQ(unit.end, in->offsets[unit.bucket_end]);
    }
  }
  EXPECT_EQ(position, in->count);
  EXPECT_EQ(next, in->call_count);
  for (int64_t c = 0; c < in->call_count; ++c) {
    const pikoir_call &call = in->calls[c];
    EXPECT_GE(call.begin, in->offsets[call.bin]);
    EXPECT_LE(call.end, in->offsets[call.bin + 1]);
    log.calls.push_back(callSeed(in, call));
  }
}

static int32_t assignSource(pikort_pipeline *p, int32_t source) {
  const pikoir_input *in = pikoir_begin_source(p, source);
  if (!in)
    return pikoir_status(p);
  auto *items = reinterpret_cast<const Item *>(in->items);
#pragma omp parallel for schedule(dynamic) num_threads(pikoir_threads(p))
  for (int64_t u = 0; u < in->unit_count; ++u) {
    pikoir_writer *w = pikoir_open_source(p, source, u);
    for (int64_t i = in->units[u].begin; i < in->units[u].end; ++i) {
      for (int64_t bucket : current->places(current->sources[source], items[i]))
        pikoir_place_source(w, bucket);
      pikoir_next(w);
    }
    pikoir_close(w);
  }
  return pikoir_end_source(p, source);
}

static int32_t runStage(pikort_pipeline *p, int32_t stage) {
  const pikoir_input *in = pikoir_begin(p, stage);
  if (!in)
    return pikoir_status(p);
  if (current->logs)
    note(stage, in);
#pragma omp parallel for schedule(dynamic) num_threads(pikoir_threads(p))
  for (int64_t u = 0; u < in->unit_count; ++u)
    runUnit(p, stage, in, u);
  return pikoir_end(p, stage);
}

static void scheduleBins(pikort_pipeline *p, int32_t stage) {
  int64_t bins = pikoir_begin_schedule(p, stage);
  EXPECT_EQ(bins, current->buckets(stage) / current->tiles(stage));
  for (int64_t bin = 0; bin < bins; ++bin) {
    int64_t batch =
        current->takesList(stage) ? current->batchOf(stage, bin) : 0;
    pikoir_schedule_bin(p, stage, bin, current->kindOf(stage, bin), bin % 3 * 5,
                        batch ? batch : PIKOIR_NO_BATCH,
                        current->everyBinOf(stage, bin));
  }
}

static bool isPlaced(size_t source) {
  return current->stages[current->sources[source]].flags & PIKOIR_PLACED;
}

/// The parts of a cycle that do not collect, each after those that emit into
/// it.
static std::vector<int32_t> sortParts(const TestComponent &component) {
  std::vector<int32_t> parts, sorted;
  for (int s : component.stages)
    if (int part = plan.partOf[s];
        !current->collects(s) && plan.parts[part].stages.front() == s)
      parts.push_back(part);
  auto feeds = [&](int from, int to) {
    for (int s : plan.parts[from].stages)
      for (int consumer : current->stages[s].ports)
        if (from != to && plan.partOf[consumer] == to)
          return true;
    return false;
  };
  while (!parts.empty()) {
    auto next = std::find_if(parts.begin(), parts.end(), [&](int to) {
      return std::none_of(parts.begin(), parts.end(),
                          [&](int from) { return feeds(from, to); });
    });
    sorted.push_back(*next);
    parts.erase(next);
  }
  return sorted;
}

static int32_t runPart(pikort_pipeline *p, int32_t part) {
  int32_t stage = plan.parts[part].stages.front();
  if (!plan.parts[part].isLoop)
    return pikoir_cycle_takes(p, stage) ? runStage(p, stage) : 0;
  while ((stage = pikoir_loop_step(p, part)) >= 0)
    if (int32_t status = runStage(p, stage))
      return status;
  return 0;
}

/// The number of the cycle that a stage is on.
static int32_t cycleOf(int stage) {
  int32_t cycle = 0;
  for (const TestComponent &component : current->order()) {
    if (std::find(component.stages.begin(), component.stages.end(), stage) !=
        component.stages.end())
      break;
    cycle += component.cyclic;
  }
  return cycle;
}

static int32_t runComponent(pikort_pipeline *p,
                            const TestComponent &component) {
  int32_t stage = component.stages.back();
  if (!component.cyclic)
    return runStage(p, stage);
  std::vector<int32_t> parts = sortParts(component);
  int32_t cycle = cycleOf(stage);
  bool collects = std::any_of(component.stages.begin(), component.stages.end(),
                              [](int s) { return current->collects(s); });
  do {
    for (int32_t part : parts)
      if (int32_t status = runPart(p, part))
        return status;
    stage = collects ? pikoir_cycle_turn(p, cycle) : -1;
    if (stage >= 0)
      if (int32_t status = runStage(p, stage))
        return status;
  } while (stage >= 0);
  return pikoir_status(p);
}

static int32_t runStrip(pikort_pipeline *p, int source) {
  if (isPlaced(static_cast<size_t>(source)))
    if (int32_t status = assignSource(p, source))
      return status;
  auto [begin, end] = current->stripRange(source);
  std::vector<TestComponent> components = current->order();
  for (size_t c = begin; c < end; ++c)
    if (int32_t status = runComponent(p, components[c]))
      return status;
  return 0;
}

static int32_t runStrips(pikort_pipeline *p, int source, int32_t group) {
  std::vector<Arrivals> before = current->arrivals;
  while (pikoir_strips_next(p, group)) {
    if (runStrip(p, source))
      current->arrivals = before; // if it is not the end, it runs again
    else
      before = current->arrivals;
  }
  return pikoir_status(p);
}

static int32_t runGraph(pikort_pipeline *p) {
  current->arrivals.assign(current->stages.size(), {});
  current->paddingSeen = false;
  for (size_t s = 0; s < current->stages.size(); ++s)
    current->arrivals[s].buckets.resize(
        static_cast<size_t>(current->buckets(static_cast<int>(s))));
  for (size_t s = 0; s < current->stages.size(); ++s)
    if (current->stages[s].perBin)
      scheduleBins(p, static_cast<int32_t>(s));
  std::vector<TestComponent> components = current->order();
  std::vector<int> groupOf(components.size(), -1);
  std::vector<int> groupSources;
  for (size_t i = 0; i < current->sources.size(); ++i) {
    auto source = static_cast<int>(i);
    if (current->stripStages(source).empty()) {
      if (int32_t status = isPlaced(i) ? assignSource(p, source) : 0)
        return status;
      continue;
    }
    auto [begin, end] = current->stripRange(source);
    for (size_t c = begin; c < end; ++c)
      groupOf[c] = static_cast<int>(groupSources.size());
    groupSources.push_back(source);
  }
  for (size_t c = 0; c < components.size(); ++c) {
    int group = groupOf[c];
    int32_t status =
        group < 0
            ? runComponent(p, components[c])
            : runStrips(p, groupSources[static_cast<size_t>(group)], group);
    if (status)
      return status;
    while (group >= 0 && c + 1 < components.size() && groupOf[c + 1] == group)
      ++c;
  }
  return 0;
}

/// As the runtime leaves it: C++ says nothing of what is in a host's.
static void clearPadding(std::vector<Item> &items) {
  for (Item &item : items) {
    char *padding = reinterpret_cast<char *>(&item.hops) + sizeof(item.hops);
    std::memset(padding, 0, offsetof(Item, check) - offsetof(Item, hops) - 1);
  }
}

GraphRun::GraphRun(Graph &graph) {
  current = &graph;
  for (std::vector<Item> &items : graph.input)
    clearPadding(items);
  pikort_program program{PIKORT_ABI_VERSION, "Graph", setup, runGraph};
  EXPECT_EQ(pikort_create(&program, &pipeline_), PIKORT_OK)
      << pikort_message(pipeline_);
  pikort_set_domain(pipeline_, 2, graph.domain);
  for (size_t i = 0; i < graph.input.size(); ++i)
    EXPECT_EQ(pikort_bind_source(
                  pipeline_, static_cast<int32_t>(i), graph.input[i].data(),
                  static_cast<int64_t>(graph.input[i].size()), sizeof(Item)),
              PIKORT_OK)
        << pikort_message(pipeline_);
}

GraphRun::~GraphRun() {
  pikort_destroy(pipeline_);
  current = nullptr;
}

int32_t GraphRun::run(int threads) {
  EXPECT_EQ(pikort_set_threads(pipeline_, threads), PIKORT_OK);
  return pikort_run(pipeline_);
}
