// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- GraphPlan.cpp - What a compiler would plan for a test pipeline -----===//

#include "graph/Graph.h"

#include <algorithm>
#include <set>

using namespace piko::rt::test;

int TestPlan::loopCount() const {
  return static_cast<int>(
      std::count_if(parts.begin(), parts.end(),
                    [](const Part &part) { return part.isLoop; }));
}

static void findParts(const Graph &graph, TestPlan &plan) {
  int count = static_cast<int>(graph.stages.size());
  plan.partOf.assign(graph.stages.size(), -1);
  for (bool loops : {true, false})
    for (int s = 0; s < count; ++s) {
      std::vector<int> stages = graph.loopOf(s);
      if (plan.partOf[s] >= 0 || stages.empty() == loops)
        continue;
      if (!loops)
        stages = {s};
      for (int member : stages)
        plan.partOf[member] = static_cast<int>(plan.parts.size());
      plan.parts.push_back({stages, loops, 0});
    }
}

namespace {
/// Finds keys: what goes into a part needs them if several edges and sources
/// do, or what comes out needs them.
class KeyPlan {
public:
  KeyPlan(const Graph &graph, TestPlan &plan) : graph(graph), plan(plan) {}

  void run() {
    for (TestPlan::Part &part : plan.parts)
      if (part.isLoop && countInputs(part) > 1)
        part.keys = 1;
    while (step())
      ;
  }

private:
  int &kept(int stage) {
    TestPlan::Part &part = plan.parts[plan.partOf[stage]];
    return part.isLoop ? part.keys : plan.keeps[stage];
  }

  void forEdges(auto &&visit) {
    for (size_t from = 0; from < graph.stages.size(); ++from)
      for (size_t port = 0; port < graph.stages[from].ports.size(); ++port) {
        int to = graph.stages[from].ports[port];
        int part = plan.partOf[from];
        if (part != plan.partOf[to] || !plan.parts[part].isLoop)
          visit(static_cast<int>(from), port, to);
      }
  }

  int64_t countInputs(const TestPlan::Part &part) {
    auto holds = [&](int stage) {
      return std::find(part.stages.begin(), part.stages.end(), stage) !=
             part.stages.end();
    };
    int64_t count =
        std::count_if(graph.sources.begin(), graph.sources.end(), holds);
    std::set<std::pair<int, int>> loops; // that lead to a stage
    forEdges([&](int from, size_t, int to) {
      int loop = plan.partOf[from];
      count += holds(to) &&
               (!plan.parts[loop].isLoop || loops.insert({loop, to}).second);
    });
    return count;
  }

  bool step() {
    bool changed = false;
    auto widen = [&](int &width, int to) {
      changed |= to > width;
      width = std::max(width, to);
    };
    auto needsKeys = [&](int stage) {
      return kept(stage) > 0 || countInputs(plan.parts[plan.partOf[stage]]) > 1;
    };
    for (int stage : graph.sources)
      if (kept(stage) > 0)
        widen(kept(stage), 1);
    forEdges([&](int from, size_t port, int to) {
      if (!needsKeys(to))
        return;
      bool collects = graph.collects(from);
      if (!collects)
        widen(kept(from), 1);
      widen(plan.keys[from][port], collects ? 2 : kept(from) + 1);
      if (kept(to) > 0)
        widen(kept(to), plan.keys[from][port]);
    });
    return changed;
  }

  const Graph &graph;
  TestPlan &plan;
};
} // namespace

TestPlan Graph::plan() const {
  TestPlan plan;
  plan.keeps.assign(stages.size(), 0);
  plan.roots.assign(stages.size(), 0);
  for (const TestStage &stage : stages)
    plan.keys.emplace_back(stage.ports.size(), 0);
  auto root = static_cast<int>(sources.size());
  for (const TestComponent &component : order()) {
    for (int s : component.stages)
      plan.roots[s] = root;
    ++root;
  }
  findParts(*this, plan);
  KeyPlan(*this, plan).run();
  return plan;
}
