// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Graph.cpp - Test pipelines, and what they mean ---------------------===//

#include "Graph.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <gtest/gtest.h>
#include <numeric>

using namespace piko::rt::test;

uint64_t piko::rt::test::mix(uint64_t a, uint64_t b) {
  uint64_t x = a * 0x9e3779b97f4a7c15u + b + 0x7f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

// --- The meaning ------------------------------------------------------------

static int64_t ceilDiv(int64_t a, int64_t b) { return (a + b - 1) / b; }

int64_t Graph::tiles(int stage) const {
  const TestStage &s = stages[stage];
  int64_t n = 1;
  for (int d = 0; d < 2 && s.tile > 0; ++d)
    n *= ceilDiv(s.bin[d] ? std::min(s.bin[d], domain[d]) : domain[d], s.tile);
  return n;
}

int64_t Graph::cells(int stage) const {
  const TestStage &s = stages[stage];
  int64_t n = tiles(stage);
  for (int d = 0; d < 2; ++d)
    n *= s.bin[d] ? ceilDiv(domain[d], s.bin[d]) : 1;
  return n;
}

std::vector<int64_t> Graph::places(int stage, const Item &item) const {
  const TestStage &s = stages[stage];
  if (!(s.flags & PIKOIR_PLACED))
    return {0};
  if (s.runLength > 0)
    return {(static_cast<int64_t>(item.id) / s.runLength ^ 1) % cells(stage)};
  uint64_t h = mix(item.id, 77 + static_cast<uint64_t>(stage));
  std::vector<int64_t> result;
  auto n = static_cast<int64_t>(h % static_cast<uint64_t>(s.spread + 1));
  result.reserve(static_cast<size_t>(n) + 1);
  for (int64_t i = 0; i < n; ++i)
    result.push_back(static_cast<int64_t>(mix(h, static_cast<uint64_t>(i)) %
                                          static_cast<uint64_t>(cells(stage))));
  if (n > 0 && h & 256)
    result.push_back(result.front());
  if (h & 512)
    std::sort(result.begin(), result.end());
  return result;
}

std::vector<std::pair<int, Item>> Graph::emissions(int stage, uint64_t seed,
                                                   int hops) const {
  const TestStage &s = stages[stage];
  std::vector<std::pair<int, Item>> result;
  if (s.ports.empty())
    return result;
  uint64_t h = mix(seed, 1000 + static_cast<uint64_t>(stage));
  auto n = h % static_cast<uint64_t>(s.mostEmissions + 1);
  for (uint64_t i = 0; i < n; ++i) {
    uint64_t id = mix(h, i);
    result.push_back({static_cast<int>((id >> 20) % s.ports.size()),
                      {id, static_cast<uint8_t>(hops + 1)}});
  }
  return result;
}

namespace {

/// Depth first, as the reference executor runs.
class Model {
public:
  explicit Model(const Graph &graph) : g_(graph), log_(graph.stages.size()) {
    for (size_t s = 0; s < log_.size(); ++s)
      log_[s].cells.resize(static_cast<size_t>(g_.cells(static_cast<int>(s))));
    waiting_.resize(log_.size());
  }

  std::vector<Arrivals> run() {
    for (size_t i = 0; i < g_.sources.size(); ++i)
      for (const Item &item : g_.input[i])
        arrive(g_.sources[i], item);
    for (int s : order())
      if (g_.stages[s].flags & PIKOIR_COLLECTS)
        runCollected(s);
    return std::move(log_);
  }

private:
  using Visit = std::pair<int64_t, Item>; // cell, item

  /// Topological, ties by number.
  std::vector<int> order() const {
    std::vector<int> waits(g_.stages.size()), result;
    for (const TestStage &s : g_.stages)
      for (int consumer : s.ports)
        ++waits[consumer];
    std::vector<bool> done(waits.size());
    while (result.size() < waits.size())
      for (size_t s = 0; s < waits.size(); ++s)
        if (!done[s] && waits[s] == 0) {
          done[s] = true;
          result.push_back(static_cast<int>(s));
          for (int consumer : g_.stages[s].ports)
            --waits[consumer];
          break;
        }
    return result;
  }

  void arrive(int stage, const Item &item) {
    std::vector<int64_t> named = g_.places(stage, item);
    std::set<int64_t> cells(named.begin(), named.end());
    if (cells.empty())
      return;
    log_[stage].items.push_back(item.id);
    for (int64_t cell : cells) {
      log_[stage].cells[static_cast<size_t>(cell)].push_back(item.id);
      if (g_.stages[stage].flags & PIKOIR_COLLECTS)
        waiting_[stage].push_back({cell, item});
      else
        emit(stage, mix(item.id, static_cast<uint64_t>(cell)), item.hops);
    }
  }

  void emit(int stage, uint64_t seed, int hops) {
    for (auto &[port, item] : g_.emissions(stage, seed, hops))
      arrive(g_.stages[stage].ports[port], item);
  }

  void runCollected(int s) {
    std::vector<Visit> visits = std::move(waiting_[s]);
    int64_t tiles = g_.tiles(s);
    std::vector<size_t> by(visits.size());
    std::iota(by.begin(), by.end(), size_t(0));
    std::sort(by.begin(), by.end(), [&](size_t a, size_t b) {
      return std::pair(visits[a].first / tiles, a) <
             std::pair(visits[b].first / tiles, b);
    });
    if (!g_.stages[s].list) {
      for (size_t v : by)
        emit(s,
             mix(visits[v].second.id, static_cast<uint64_t>(visits[v].first)),
             visits[v].second.hops);
      return;
    }
    for (int64_t cell = 0; cell < g_.cells(s); ++cell) { // every bin
      uint64_t seed = static_cast<uint64_t>(cell);
      for (uint64_t id : log_[s].cells[static_cast<size_t>(cell)])
        seed = mix(seed, id);
      emit(s, seed, 0);
    }
  }

  const Graph &g_;
  std::vector<Arrivals> log_;
  std::vector<std::vector<Visit>> waiting_;
};

} // namespace

std::vector<Arrivals> Graph::model() const { return Model(*this).run(); }

Graph Graph::random(uint64_t seed, int stageCount, int64_t items) {
  Graph g;
  uint64_t state = seed;
  auto draw = [&](int below) {
    state = mix(state, 5);
    return static_cast<int>((state >> 8) % static_cast<uint64_t>(below));
  };
  static const int64_t bins[] = {0, 3, 4, 8, 1};
  for (int s = 0; s < stageCount; ++s) {
    TestStage stage;
    stage.bin[0] = bins[draw(5)];
    stage.bin[1] = bins[draw(5)];
    if (draw(4))
      stage.flags |= PIKOIR_PLACED;
    else
      stage.bin[0] = stage.bin[1] = 0;
    if (draw(3) == 0)
      stage.flags |= PIKOIR_COLLECTS;
    if (draw(2))
      stage.flags |= PIKOIR_SPLIT;
    if (draw(3) == 0 && stage.flags & PIKOIR_PLACED)
      stage.tile = 2;
    if (draw(4) == 0)
      stage.split = 5;
    stage.schedule = draw(4);
    stage.list = stage.flags & PIKOIR_COLLECTS && !stage.tile && draw(2);
    if (stage.list)
      stage.flags &= ~PIKOIR_SPLIT;
    stage.spread = draw(4) ? 3 : 1;
    int ports = s + 1 < stageCount ? 1 + draw(3) : 0;
    for (int i = 0; i < ports; ++i)
      stage.ports.push_back(s + 1 + draw(std::min(3, stageCount - s - 1)));
    g.stages.push_back(stage);
  }
  int sources = 1 + draw(3);
  for (int i = 0; i < sources; ++i) {
    g.sources.push_back(draw(std::min(3, stageCount)));
    std::vector<Item> input(static_cast<size_t>(draw(8) ? items : 0));
    for (size_t k = 0; k < input.size(); ++k)
      input[k].id = mix(seed + static_cast<uint64_t>(i), k);
    g.input.push_back(std::move(input));
  }
  return g;
}

// --- Through the ABI --------------------------------------------------------

static Graph *current = nullptr;

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
    for (size_t port = 0; port < stage.ports.size(); ++port)
      pikoir_declare_edge(p, id, static_cast<int32_t>(port), stage.ports[port]);
  }
  for (size_t i = 0; i < current->sources.size(); ++i)
    pikoir_declare_source(p, static_cast<int32_t>(i), current->sources[i]);
}

/// One emission, by the inline fast path or by calls.
static void write(pikoir_writer *w, int stage, int32_t port, const Item &item,
                  bool fast) {
  auto *room = reinterpret_cast<Item *>(fast ? pikoir_append_inline(w, port)
                                             : pikoir_append(w, port));
  room->id = item.id;
  room->hops = item.hops;
  int consumer = current->stages[stage].ports[port];
  if (current->stages[consumer].flags & PIKOIR_PLACED)
    for (int64_t cell : current->places(consumer, item))
      fast ? pikoir_place_inline(w, port, cell) : pikoir_place(w, port, cell);
}

static void runUnit(pikort_pipeline *p, int stage, const pikoir_input *in,
                    int64_t u) {
  const pikoir_unit &unit = in->units[u];
  const TestStage &s = current->stages[stage];
  auto *items = reinterpret_cast<const Item *>(in->items);
  bool fast = mix(static_cast<uint64_t>(stage), 3) & 1;
  pikoir_writer *w = pikoir_open(p, stage, u);
  auto emit = [&](uint64_t seed, int hops) {
    for (auto &[port, item] : current->emissions(stage, seed, hops))
      write(w, stage, port, item, fast);
    fast ? pikoir_next_inline(w) : pikoir_next(w);
  };
  int64_t cell = unit.cell_begin;
  for (int64_t i = unit.begin; i < unit.end && !s.list; ++i) {
    while (in->offsets[cell + 1] <= i)
      ++cell;
    const Item &item = items[in->order ? in->order[i] : i];
    emit(mix(item.id, static_cast<uint64_t>(cell)), item.hops);
  }
  for (; s.list && cell < unit.cell_end; ++cell) {
    uint64_t seed = static_cast<uint64_t>(cell);
    for (int64_t i = in->offsets[cell]; i < in->offsets[cell + 1]; ++i)
      seed = mix(seed, items[in->order ? in->order[i] : i].id);
    emit(seed, 0);
  }
  pikoir_close(w);
}

/// Notes what reached a stage, and checks that the input is well formed.
static void note(int stage, const pikoir_input *in) {
  Arrivals &log = current->arrivals[stage];
  auto *items = reinterpret_cast<const Item *>(in->items);
  int64_t cells = current->cells(stage);
  EXPECT_EQ(in->tiles, current->tiles(stage));
  EXPECT_EQ(in->offsets[0], 0);
  EXPECT_EQ(in->offsets[cells], in->count);
  int64_t itemCount = 0;
  log.cells.resize(static_cast<size_t>(cells));
  std::set<int64_t> seen;
  for (int64_t c = 0; c < cells; ++c)
    for (int64_t i = in->offsets[c]; i < in->offsets[c + 1]; ++i) {
      int64_t item = in->order ? in->order[i] : i;
      itemCount = std::max(itemCount, item + 1);
      seen.insert(item);
      log.cells[static_cast<size_t>(c)].push_back(items[item].id);
      static const char zeros[7] = {};
      current->paddingSeen |=
          std::memcmp(&items[item].hops + 1, zeros, sizeof(zeros)) != 0;
    }
  for (int64_t item : seen)
    log.items.push_back(items[item].id);
  int64_t position = 0, cell = 0;
  for (int64_t u = 0; u < in->unit_count; ++u) {
    const pikoir_unit &unit = in->units[u];
    EXPECT_EQ(unit.begin, position);
    EXPECT_GE(unit.begin, in->offsets[unit.cell_begin]);
    EXPECT_LE(unit.end, in->offsets[unit.cell_end]);
    if (unit.cell_end - unit.cell_begin > 1) {
      EXPECT_EQ(unit.begin, in->offsets[unit.cell_begin]);
      EXPECT_EQ(unit.end, in->offsets[unit.cell_end]);
    }
    if (current->stages[stage].flags & PIKOIR_COLLECTS) {
      EXPECT_LE(unit.cell_begin, cell);
      cell = unit.cell_end;
    }
    position = unit.end;
  }
  EXPECT_EQ(position, in->count);
  if (current->stages[stage].flags & PIKOIR_COLLECTS)
    EXPECT_EQ(cell, cells);
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
      for (int64_t cell : current->places(current->sources[source], items[i]))
        pikoir_place_source(w, cell);
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
  note(stage, in);
#pragma omp parallel for schedule(dynamic) num_threads(pikoir_threads(p))
  for (int64_t u = 0; u < in->unit_count; ++u)
    runUnit(p, stage, in, u);
  return pikoir_end(p, stage);
}

static int32_t runGraph(pikort_pipeline *p) {
  current->arrivals.assign(current->stages.size(), {});
  current->paddingSeen = false;
  for (size_t i = 0; i < current->sources.size(); ++i)
    if (current->stages[current->sources[i]].flags & PIKOIR_PLACED)
      if (int32_t status = assignSource(p, static_cast<int32_t>(i)))
        return status;
  // Stages are numbered producers first.
  for (size_t s = 0; s < current->stages.size(); ++s)
    if (int32_t status = runStage(p, static_cast<int32_t>(s)))
      return status;
  return 0;
}

GraphRun::GraphRun(Graph &graph) {
  current = &graph;
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
