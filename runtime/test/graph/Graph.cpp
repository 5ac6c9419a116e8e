// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Graph.cpp - Test pipelines, and what they mean ---------------------===//

#include "graph/Graph.h"

#include <algorithm>
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
    result[i] = {mix(seed, i)};
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

int64_t Graph::buckets(int stage) const {
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
    return {(static_cast<int64_t>(item.id) / s.runLength ^ 1) % buckets(stage)};
  uint64_t h = mix(item.id, 77 + static_cast<uint64_t>(stage));
  std::vector<int64_t> result;
  auto n = static_cast<int64_t>(h % static_cast<uint64_t>(s.spread + 1));
  result.reserve(static_cast<size_t>(n) + 1);
  for (int64_t i = 0; i < n; ++i)
    result.push_back(
        static_cast<int64_t>(mix(h, static_cast<uint64_t>(i)) %
                             static_cast<uint64_t>(buckets(stage))));
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
                          (buckets(s) > tiles(s) && !stages[s].ports.empty())))
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
    std::sort(arrivals[s].items.begin(), arrivals[s].items.end());
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
    for (auto &bucket : log.buckets)
      std::sort(bucket.begin(), bucket.end());
  }
}

namespace {

/// Depth first, as the reference executor runs.
class Model {
public:
  explicit Model(const Graph &graph) : g_(graph), log_(graph.stages.size()) {
    for (size_t s = 0; s < log_.size(); ++s)
      log_[s].buckets.resize(
          static_cast<size_t>(g_.buckets(static_cast<int>(s))));
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
  using Visit = std::pair<int64_t, Item>; // bucket, item

  void arrive(int stage, const Item &item) {
    std::vector<int64_t> named = g_.places(stage, item);
    std::set<int64_t> buckets(named.begin(), named.end());
    if (buckets.empty())
      return;
    log_[stage].items.push_back(item.id);
    for (int64_t bucket : buckets) {
      log_[stage].buckets[static_cast<size_t>(bucket)].push_back(item.id);
      if (g_.collects(stage))
        waiting_[stage].push_back({bucket, item});
      else
        emit(stage, mix(item.id, static_cast<uint64_t>(bucket)), item.hops);
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
      for (auto &[bucket, item] : visits)
        emit(s, mix(item.id, static_cast<uint64_t>(bucket)), item.hops);
      return;
    }
    size_t next = 0;
    for (int64_t bin = 0; bin < g_.buckets(s); ++bin) {
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
    stage.reordered = draw(4) == 0;
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
      input[k] = {mix(seed + static_cast<uint64_t>(i), k)};
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

// --- Comparison -------------------------------------------------------------

void piko::rt::test::checkArrivals(Graph &graph,
                                   const std::vector<Arrivals> &expected,
                                   const std::string &what) {
  graph.normalise(graph.arrivals);
  for (size_t s = 0; s < expected.size(); ++s) {
    ASSERT_EQ(graph.arrivals[s].items, expected[s].items)
        << "stage " << s << ", " << what;
    ASSERT_EQ(graph.arrivals[s].buckets, expected[s].buckets)
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
