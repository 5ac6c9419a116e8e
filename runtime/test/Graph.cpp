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

std::vector<Item> piko::rt::test::makeItems(int64_t count, uint64_t seed) {
  std::vector<Item> result(static_cast<size_t>(count));
  for (size_t i = 0; i < result.size(); ++i)
    result[i].id = mix(seed, i);
  return result;
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
  if (s.ports.empty() || hops >= mostHops)
    return result;
  uint64_t h = mix(seed, 1000 + static_cast<uint64_t>(stage));
  auto most = static_cast<uint64_t>(s.mostEmissions);
  auto n = alwaysEmits ? most : h % (most + 1);
  for (uint64_t i = 0; i < n; ++i) {
    uint64_t id = mix(h, i);
    result.push_back({static_cast<int>((id >> 20) % s.ports.size()),
                      {id, static_cast<uint8_t>(hops + 1)}});
  }
  return result;
}

int Graph::kindOf(int stage, int64_t bin) const {
  const TestStage &s = stages[stage];
  return s.perBin ? static_cast<int>(mix(static_cast<uint64_t>(bin), 1) % 4)
                  : s.schedule;
}

int64_t Graph::batchOf(int stage, int64_t bin) const {
  const TestStage &s = stages[stage];
  return s.perBin ? static_cast<int64_t>(mix(static_cast<uint64_t>(bin), 2) % 4)
                  : s.batch;
}

bool Graph::everyBinOf(int stage, int64_t bin) const {
  const TestStage &s = stages[stage];
  return s.perBin ? mix(static_cast<uint64_t>(bin), 3) & 1 : s.everyBin;
}

/// reach[i][j]: some edges that `follow` accepts lead from i to j.
static std::vector<std::vector<bool>> reachability(const Graph &g,
                                                   auto &&follow) {
  size_t n = g.stages.size();
  std::vector reach(n, std::vector<bool>(n));
  for (size_t i = 0; i < n; ++i)
    for (int to : g.stages[i].ports)
      if (follow(to))
        reach[i][static_cast<size_t>(to)] = true;
  for (size_t k = 0; k < n; ++k)
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < n; ++j)
        if (reach[i][k] && reach[k][j])
          reach[i][j] = true;
  return reach;
}

std::vector<int> Graph::loopOf(int stage) const {
  auto reach = reachability(*this, [&](int to) { return !collects(to); });
  auto s = static_cast<size_t>(stage);
  std::vector<int> loop;
  for (size_t t = 0; t < stages.size(); ++t)
    if (reach[s][t] && reach[t][s])
      loop.push_back(static_cast<int>(t));
  return loop;
}

std::vector<TestComponent> Graph::order() const {
  auto reach = reachability(*this, [](int) { return true; });
  size_t n = stages.size();
  auto together = [&](size_t a, size_t b) {
    return a == b || (reach[a][b] && reach[b][a]);
  };
  std::vector<bool> done(n);
  auto ready = [&](size_t s) {
    for (size_t t = 0; t < n; ++t) {
      if (together(s, t) || done[t])
        continue;
      for (int to : stages[t].ports)
        if (together(s, static_cast<size_t>(to)))
          return false;
      for (size_t member = 0; member < n; ++member)
        for (int waitedFor : stages[member].waits)
          if (together(s, member) && static_cast<int>(t) == waitedFor)
            return false;
    }
    return true;
  };
  std::vector<TestComponent> result;
  for (size_t s = 0; s < n;) {
    if (done[s] || !ready(s)) {
      ++s;
      continue;
    }
    TestComponent &component = result.emplace_back();
    component.cyclic = reach[s][s];
    for (size_t t = s; t < n; ++t)
      if (together(s, t)) {
        done[t] = true;
        component.stages.push_back(static_cast<int>(t));
      }
    s = 0;
  }
  return result;
}

std::pair<size_t, size_t> Graph::stripRange(int source) const {
  std::vector<TestComponent> components = order();
  std::vector<bool> inside(stages.size());
  auto canRun = [&](const TestComponent &component, bool first) {
    auto isOf = [&](int s) {
      return std::find(component.stages.begin(), component.stages.end(), s) !=
             component.stages.end();
    };
    int fed = 0;
    for (size_t i = 0; i < sources.size(); ++i)
      if (isOf(sources[i]) && (!first || static_cast<int>(i) != source))
        return false;
      else
        fed += isOf(sources[i]);
    for (size_t from = 0; from < stages.size(); ++from)
      for (int to : stages[from].ports)
        if (isOf(to) && !isOf(static_cast<int>(from)) && !inside[from])
          return false;
    for (int s : component.stages)
      if (collects(s) && (takesList(s) || !first || component.cyclic ||
                          (cells(s) > tiles(s) && !stages[s].ports.empty())))
        return false;
    return fed == first;
  };
  size_t begin = 0;
  while (begin < components.size() && !canRun(components[begin], true))
    ++begin;
  size_t end = begin;
  while (end < components.size() && canRun(components[end], end == begin)) {
    for (int s : components[end].stages)
      inside[static_cast<size_t>(s)] = true;
    ++end;
  }
  return {begin, end};
}

std::vector<int> Graph::stripStages(int source) const {
  std::vector<TestComponent> components = order();
  std::vector<int> result;
  auto [begin, end] = stripRange(source);
  for (size_t c = begin; strips && c < end; ++c)
    result.insert(result.end(), components[c].stages.begin(),
                  components[c].stages.end());
  return result;
}

void Graph::normalise(std::vector<Arrivals> &arrivals) const {
  for (size_t s = 0; s < stages.size(); ++s) {
    std::vector<int> loop = loopOf(static_cast<int>(s));
    if (loop.empty())
      continue;
    bool ordered = false;
    for (int member : loop)
      ordered |= (stages[member].flags & PIKOIR_ORDERED) != 0;
    Arrivals &log = arrivals[s];
    if (ordered) {
      log.items.clear();
      continue;
    }
    std::sort(log.items.begin(), log.items.end());
    for (auto &cell : log.cells)
      std::sort(cell.begin(), cell.end());
  }
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
    for (const TestComponent &component : g_.order()) {
      bool more = true;
      for (int round = 0; more; ++round) {
        more = false;
        for (int s : component.stages)
          if (g_.collects(s))
            runCollected(s, round == 0);
        for (int s : component.stages)
          more |= !waiting_[s].empty();
      }
    }
    return std::move(log_);
  }

private:
  using Visit = std::pair<int64_t, Item>; // cell, item

  void arrive(int stage, const Item &item) {
    std::vector<int64_t> named = g_.places(stage, item);
    std::set<int64_t> cells(named.begin(), named.end());
    if (cells.empty())
      return;
    log_[stage].items.push_back(item.id);
    for (int64_t cell : cells) {
      log_[stage].cells[static_cast<size_t>(cell)].push_back(item.id);
      if (g_.collects(stage))
        waiting_[stage].push_back({cell, item});
      else
        emit(stage, mix(item.id, static_cast<uint64_t>(cell)), item.hops);
    }
  }

  void emit(int stage, uint64_t seed, int hops) {
    for (auto &[port, item] : g_.emissions(stage, seed, hops))
      arrive(g_.stages[stage].ports[port], item);
  }

  void runCollected(int s, bool firstRound) {
    std::vector<Visit> visits = std::exchange(waiting_[s], {});
    int64_t tiles = g_.tiles(s);
    std::vector<size_t> order(visits.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
      return std::pair(visits[a].first / tiles, a) <
             std::pair(visits[b].first / tiles, b);
    });
    std::vector<Visit> unsorted = visits;
    for (size_t i = 0; i < order.size(); ++i)
      visits[i] = unsorted[order[i]];
    if (!g_.takesList(s)) {
      for (auto &[cell, item] : visits)
        emit(s, mix(item.id, static_cast<uint64_t>(cell)), item.hops);
      return;
    }
    size_t next = 0;
    for (int64_t bin = 0; bin < g_.cells(s); ++bin) {
      size_t begin = next;
      while (next < visits.size() && visits[next].first == bin)
        ++next;
      if (begin == next && !(g_.everyBinOf(s, bin) && firstRound))
        continue;
      size_t batch = static_cast<size_t>(g_.batchOf(s, bin));
      do {
        uint64_t seed = static_cast<uint64_t>(bin);
        int hops = 0;
        size_t end = batch ? std::min(next, begin + batch) : next;
        for (; begin < end; ++begin) {
          seed = mix(seed, visits[begin].second.id);
          hops = std::max<int>(hops, visits[begin].second.hops);
        }
        log_[s].calls.push_back(seed);
        emit(s, seed, hops);
      } while (begin < next);
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
    if (stage.flags & PIKOIR_COLLECTS && !stage.tile && draw(2)) {
      stage.flags |= PIKOIR_LIST;
      if (draw(2))
        stage.flags &= ~PIKOIR_COLLECTS; // LIST says it all
      stage.batch = draw(2) ? draw(5) : 0;
      stage.everyBin = draw(2);
    }
    stage.perBin = draw(4) == 0;
    stage.deferred = draw(4) == 0;
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

Graph Graph::randomCyclic(uint64_t seed, int stageCount, int64_t items) {
  Graph g = random(seed, stageCount, items);
  uint64_t state = seed;
  auto draw = [&](int below) {
    state = mix(state, 6);
    return static_cast<int>((state >> 8) % static_cast<uint64_t>(below));
  };
  for (int s = 0; s < stageCount; ++s) {
    TestStage &stage = g.stages[s];
    if (draw(2))
      stage.ports.push_back(draw(s + 1));
    if (draw(6) == 0)
      stage.flags |= PIKOIR_ORDERED;
    stage.spread = std::min(stage.spread, 2);
  }
  g.mostHops = 6;
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
    if (stage.flags & PIKOIR_LIST)
      pikoir_declare_schedule(p, id, stage.batch, stage.everyBin);
    for (int waitedFor : stage.waits)
      pikoir_declare_wait(p, id, waitedFor);
    for (size_t port = 0; port < stage.ports.size(); ++port)
      pikoir_declare_edge(p, id, static_cast<int32_t>(port), stage.ports[port]);
  }
  for (size_t i = 0; i < current->sources.size(); ++i)
    pikoir_declare_source(p, static_cast<int32_t>(i), current->sources[i]);
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
  int consumer = current->stages[stage].ports[port];
  if (current->stages[consumer].flags & PIKOIR_PLACED)
    for (int64_t cell : current->places(consumer, item))
      fast ? pikoir_place_inline(w, port, cell) : pikoir_place(w, port, cell);
}

/// All emissions of a call, two from each iteration: first one from each, in
/// order, then, after a barrier, the other from each, in reverse.
static void writeDeferred(pikoir_writer *w, int stage,
                          const std::vector<std::pair<int, Item>> &emissions) {
  auto count = static_cast<int64_t>(emissions.size());
  int64_t iterations = (count + 1) / 2;
  auto emit = [&](int64_t iteration, int64_t i) {
    pikoir_defer_iteration(w, iteration);
    auto &[port, item] = emissions[static_cast<size_t>(i)];
    write(w, stage, port, item, i & 2);
  };
  pikoir_defer_begin(w, iterations);
  for (int64_t i = 0; i < iterations; ++i)
    emit(i, 2 * i);
  for (int64_t i = iterations - 1; i >= 0; --i)
    if (2 * i + 1 < count)
      emit(i, 2 * i + 1);
  pikoir_defer_end(w);
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
    if (s.deferred)
      writeDeferred(w, stage, emissions);
    else
      for (auto &[port, item] : emissions)
        write(w, stage, port, item, fast);
    fast ? pikoir_next_inline(w) : pikoir_next(w);
  };
  int64_t cell = unit.cell_begin;
  for (int64_t i = unit.begin; i < unit.end && !in->calls; ++i) {
    while (in->offsets[cell + 1] <= i)
      ++cell;
    const Item &item = items[in->order ? in->order[i] : i];
    emit(mix(item.id, static_cast<uint64_t>(cell)), item.hops);
  }
  for (; in->calls && cell < unit.cell_end; ++cell) {
    const pikoir_call &call = in->calls[cell];
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
  int64_t itemCount = 0;
  std::set<int64_t> seen;
  auto noteCells = [&](int64_t begin, int64_t end) {
    for (int64_t c = begin; c < end; ++c)
      for (int64_t i = in->offsets[c]; i < in->offsets[c + 1]; ++i) {
        int64_t item = in->order ? in->order[i] : i;
        itemCount = std::max(itemCount, item + 1);
        seen.insert(item);
        log.cells[static_cast<size_t>(c)].push_back(items[item].id);
        static const char zeros[7] = {};
        current->paddingSeen |=
            std::memcmp(&items[item].hops + 1, zeros, sizeof(zeros)) != 0;
      }
  };
  int64_t cell = 0; // up to which cells are noted; several units may share one
  for (int64_t u = 0; u < in->unit_count && !in->calls; ++u) {
    noteCells(std::max(cell, in->units[u].cell_begin), in->units[u].cell_end);
    cell = in->units[u].cell_end;
  }
  for (int64_t c = 0; c < in->call_count; ++c)
    if (c == 0 || in->calls[c].bin != in->calls[c - 1].bin) {
      int64_t tiles = in->tiles, bin = in->calls[c].bin;
      noteCells(bin * tiles, (bin + 1) * tiles);
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
      EXPECT_EQ(unit.cell_begin, next);
      next = unit.cell_end;
      EXPECT_EQ(in->calls[unit.cell_begin].begin, unit.begin);
      EXPECT_EQ(in->calls[next - 1].end, unit.end);
      bool splits = (current->stages[stage].flags &
                     (PIKOIR_SPLIT | PIKOIR_ORDERED)) == PIKOIR_SPLIT;
      if (next < in->call_count && !splits)
        EXPECT_LT(in->calls[next - 1].bin, in->calls[next].bin);
      continue;
    }
    EXPECT_GE(unit.begin, in->offsets[unit.cell_begin]);
    EXPECT_LE(unit.end, in->offsets[unit.cell_end]);
    if (unit.cell_end - unit.cell_begin > 1 ||
        current->stages[stage].flags & PIKOIR_ORDERED) {
      EXPECT_EQ(unit.begin, in->offsets[unit.cell_begin]);
      EXPECT_EQ(unit.end, in->offsets[unit.cell_end]);
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
  if (current->logs)
    note(stage, in);
#pragma omp parallel for schedule(dynamic) num_threads(pikoir_threads(p))
  for (int64_t u = 0; u < in->unit_count; ++u)
    runUnit(p, stage, in, u);
  return pikoir_end(p, stage);
}

static void scheduleBins(pikort_pipeline *p, int32_t stage) {
  int64_t bins = pikoir_begin_schedule(p, stage);
  EXPECT_EQ(bins, current->cells(stage) / current->tiles(stage));
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

static int32_t runComponent(pikort_pipeline *p,
                            const TestComponent &component) {
  int32_t stage = component.stages.back();
  if (!component.cyclic)
    return runStage(p, stage);
  while ((stage = pikoir_cycle_step(p, component.stages.back())) >= 0)
    if (int32_t status = runStage(p, stage))
      return status;
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
    current->arrivals[s].cells.resize(
        static_cast<size_t>(current->cells(static_cast<int>(s))));
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

std::string GraphRun::creationError(Graph &graph) {
  current = &graph;
  pikort_program program{PIKORT_ABI_VERSION, "Graph", setup, runGraph};
  pikort_pipeline *pipeline = nullptr;
  EXPECT_EQ(pikort_create(&program, &pipeline), PIKORT_BAD_PROGRAM);
  std::string message = pikort_message(pipeline);
  pikort_destroy(pipeline);
  current = nullptr;
  return message;
}

GraphRun::~GraphRun() {
  pikort_destroy(pipeline_);
  current = nullptr;
}

int32_t GraphRun::run(int threads) {
  EXPECT_EQ(pikort_set_threads(pipeline_, threads), PIKORT_OK);
  return pikort_run(pipeline_);
}

// --- Comparison -------------------------------------------------------------

void piko::rt::test::checkArrivals(Graph &graph,
                                   const std::vector<Arrivals> &expected,
                                   const std::string &what) {
  graph.normalise(graph.arrivals);
  for (size_t s = 0; s < expected.size(); ++s) {
    ASSERT_EQ(graph.arrivals[s].items, expected[s].items)
        << "stage " << s << ", " << what;
    ASSERT_EQ(graph.arrivals[s].cells, expected[s].cells)
        << "stage " << s << ", " << what;
    ASSERT_EQ(graph.arrivals[s].calls, expected[s].calls)
        << "stage " << s << ", " << what;
  }
  EXPECT_FALSE(graph.paddingSeen);
}

void piko::rt::test::checkOrder(Graph &graph, int64_t stripSize) {
  std::vector<Arrivals> expected = graph.model();
  graph.normalise(expected);
  GraphRun run(graph);
  ASSERT_EQ(pikort_set_strip_size(run.get(), stripSize), PIKORT_OK);
  for (int threads : {1, 2, 7, 2}) {
    ASSERT_EQ(run.run(threads), PIKORT_OK) << pikort_message(run.get());
    checkArrivals(graph, expected, std::to_string(threads) + " threads");
  }
}
