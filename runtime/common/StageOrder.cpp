// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- StageOrder.cpp - Finds cycles, and orders the stages ---------------===//
//
// Stages on a common cycle of edges form a component. The order takes, again
// and again, the component all of whose producers and waited-for stages outside
// it are taken, and of several the one with the stage that is declared first;
// within a component stages are in order of declaration. Components are the
// roots of lineage.
//
// A loop is a cycle of stages that do not collect. It is a component, or a part
// of one that also has stages that collect. Without its loops, and cut where
// stages collect, the graph has no cycle.
//
//===----------------------------------------------------------------------===//

#include "common/Pipeline.h"

#include <algorithm>

using namespace piko::rt;

[[noreturn]] static void bad(const std::string &text) {
  throw Failure{PIKORT_BAD_PROGRAM, text};
}

namespace {

/// The stages that lead to, or follow from, others.
using Neighbours = std::vector<std::vector<int32_t>>;

/// What can be reached from `from` by one step or more.
std::vector<bool> reach(const Neighbours &next, int32_t from) {
  std::vector<bool> seen(next.size());
  std::vector<int32_t> stack = {from};
  while (!stack.empty()) {
    int32_t s = stack.back();
    stack.pop_back();
    for (int32_t to : next[s])
      if (!seen[to]) {
        seen[to] = true;
        stack.push_back(to);
      }
  }
  return seen;
}

} // namespace

/// The strongly connected components under the edges that `follow` accepts, by
/// their first stage.
static std::vector<Component> findComponents(const pikort_pipeline &p,
                                             auto &&follow) {
  Neighbours next(p.stages.size()), previous(p.stages.size());
  for (const Edge &edge : p.edges)
    if (follow(edge)) {
      next[edge.producer].push_back(edge.consumer);
      previous[edge.consumer].push_back(edge.producer);
    }
  std::vector<Component> components;
  std::vector<bool> taken(p.stages.size());
  for (int32_t s = 0; s < static_cast<int32_t>(p.stages.size()); ++s) {
    if (taken[s])
      continue;
    Component &component = components.emplace_back();
    component.stages = {s};
    taken[s] = true;
    if (next[s].empty() || previous[s].empty())
      continue;
    std::vector<bool> after = reach(next, s), before = reach(previous, s);
    component.cyclic = after[s];
    for (int32_t t = s + 1; t < static_cast<int32_t>(p.stages.size()); ++t)
      if (after[t] && before[t]) {
        taken[t] = true;
        component.stages.push_back(t);
      }
  }
  return components;
}

void pikort_pipeline::findLoops() {
  for (Component &found : findComponents(*this, [&](const Edge &e) {
         return !stages[e.consumer].collects();
       })) {
    if (!found.cyclic)
      continue;
    LoopShape &loop = loops.emplace_back();
    loop.stages = std::move(found.stages);
    for (int32_t s : loop.stages) {
      stages[s].loop = static_cast<int32_t>(loops.size()) - 1;
      loop.ordered |= stages[s].ordered();
    }
  }
  for (Edge &edge : edges) {
    int32_t loop = stages[edge.producer].loop;
    edge.insideLoop = loop >= 0 && loop == stages[edge.consumer].loop;
  }
}

void pikort_pipeline::sortStages() {
  std::vector<Component> rest =
      findComponents(*this, [](const Edge &) { return true; });
  std::vector<size_t> in(stages.size()), waiting(rest.size());
  for (size_t c = 0; c < rest.size(); ++c)
    for (int32_t s : rest[c].stages)
      in[s] = c;
  std::vector<std::vector<size_t>> waiters(rest.size());
  auto waitsFor = [&](int32_t stage, int32_t before) {
    if (in[stage] == in[before])
      return;
    ++waiting[in[stage]];
    waiters[in[before]].push_back(in[stage]);
  };
  for (const Edge &edge : edges)
    waitsFor(edge.consumer, edge.producer);
  for (const Wait &wait : waits)
    waitsFor(wait.stage, wait.waitsFor);
  std::vector<bool> done(rest.size());
  while (components.size() < rest.size()) {
    size_t next = 0;
    while (next < rest.size() && (done[next] || waiting[next] > 0))
      ++next;
    if (next == rest.size()) // only waits can close such a circle
      for (const Wait &wait : waits)
        if (!done[in[wait.stage]] && !done[in[wait.waitsFor]])
          bad("stage " + quoted(stages[wait.stage].name) +
              ": waits for stage " + quoted(stages[wait.waitsFor].name) +
              ", which cannot finish before it");
    done[next] = true;
    for (size_t waiter : waiters[next])
      --waiting[waiter];
    for (int32_t s : rest[next].stages) {
      stages[s].component = static_cast<int32_t>(components.size());
      stages[s].root = static_cast<int32_t>(sources.size() + components.size());
      order.push_back(s);
    }
    components.push_back(std::move(rest[next]));
  }
}

// --- Lineage keys -----------------------------------------------------------

/// Keys are needed where several edges or sources come into a stage, or into a
/// loop, and on the way there: what goes into a stage, or into a loop, needs
/// keys if what comes out does, unless that starts a new lineage.
void pikort_pipeline::findKeys() {
  std::vector<int64_t> inputs(loops.size());
  for (const Stage &stage : stages)
    if (stage.loop >= 0)
      inputs[stage.loop] += static_cast<int64_t>(stage.sources.size());
  for (const Edge &edge : edges)
    if (stages[edge.consumer].loop >= 0 && !edge.insideLoop)
      ++inputs[stages[edge.consumer].loop];
  std::vector<bool> itemsKeyed(stages.size());
  for (size_t l = 0; l < loops.size(); ++l)
    loops[l].keyed = inputs[l] > 1;
  for (bool changed = true; changed;) {
    changed = false;
    for (Edge &edge : edges) {
      const Stage &to = stages[edge.consumer], &from = stages[edge.producer];
      bool merges = to.inputs.size() + to.sources.size() > 1;
      bool keyed = to.loop >= 0 ? loops[to.loop].keyed
                                : itemsKeyed[edge.consumer] || merges;
      if (edge.insideLoop || edge.keyed || !keyed)
        continue;
      edge.keyed = changed = true;
      if (from.loop >= 0)
        loops[from.loop].keyed = true;
      else if (!from.collects())
        itemsKeyed[edge.producer] = true;
    }
  }
  findKeyWidths(itemsKeyed);
}

/// A word for a source's primitives, two for what a stage that collects emits,
/// one more for each hop; a loop counts as one hop.
void pikort_pipeline::findKeyWidths(const std::vector<bool> &itemsKeyed) {
  auto widen = [](int32_t &width, int32_t to) {
    bool changed = to > width;
    width = std::max(width, to);
    return changed;
  };
  for (size_t s = 0; s < stages.size(); ++s)
    stages[s].keyWidth = itemsKeyed[s] ? 1 : 0;
  for (LoopShape &loop : loops)
    loop.keyWidth = loop.keyed ? 1 : 0;
  for (bool changed = true; changed;) {
    changed = false;
    for (Edge &edge : edges) {
      if (!edge.keyed)
        continue;
      const Stage &from = stages[edge.producer];
      Stage &to = stages[edge.consumer];
      int32_t width = from.collects()  ? 2
                      : from.loop >= 0 ? loops[from.loop].keyWidth + 1
                                       : from.keyWidth + 1;
      changed |= widen(edge.keyWidth, width);
      if (to.loop >= 0)
        changed |= widen(loops[to.loop].keyWidth, width);
      else if (itemsKeyed[edge.consumer])
        changed |= widen(to.keyWidth, width);
    }
  }
}
