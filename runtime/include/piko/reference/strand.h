//===- piko/reference/strand.h - What may run at the same time ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// For checking mode: the calls of a run, the iterations within them, and which
// of them are concurrent by the rules in docs/Diagnostics.md, "Rules".
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_STRAND_H
#define PIKO_REFERENCE_STRAND_H

#include <piko/reference/graph.h>
#include <piko/reference/lineage.h>

namespace piko::reference {

enum class Phase { Assign, Schedule, Process };

struct Element;

/// One call of a phase.
struct Call {
  Phase phase;
  const Node *node;
  int64_t bin;
  Lineage lineage;
  int64_t turn; ///< how many collecting stages have run, in all rounds
};

/// What runs in sequence: a call, or an iteration between two barriers.
struct Strand {
  std::shared_ptr<Call> call;
  std::shared_ptr<const Strand> outer; ///< null for a call
  int64_t loop = -1;                   ///< which execution of a parallelFor
  int64_t interval = 0;                ///< barriers passed
  int64_t iteration = -1;
  std::vector<Element *> named; ///< elements that it has a reference to
};

/// Which stages are done before others begin.
class StageOrder {
public:
  struct SourceOf {
    int64_t number;
    const Node *node;
  };

  StageOrder() = default;
  StageOrder(const std::vector<Node *> &nodes,
             const std::vector<SourceOf> &sources,
             const std::vector<Component> &components)
      : nodes(nodes.begin(), nodes.end()), component(nodes.size()),
        collecting(components.size()) {
    for (size_t c = 0; c < components.size(); ++c)
      for (const Node *node : components[c].nodes) {
        component[indexOf(node)] = c;
        collecting[c] = collecting[c] || node->collects();
      }
    findDone(sources);
    findComplete(sources);
  }

  bool areConcurrent(const Call &a, const Call &b) const {
    if (a.phase == Phase::Assign || b.phase == Phase::Assign) {
      const Call &assign = a.phase == Phase::Assign ? a : b;
      const Call &other = a.phase == Phase::Assign ? b : a;
      return !complete[indexOf(assign.node)][indexOf(other.node)];
    }
    size_t x = indexOf(a.node), y = indexOf(b.node);
    if (component[x] == component[y] && collecting[component[x]] &&
        a.turn != b.turn)
      return false;
    return !done[y][x] && !done[x][y];
  }

  bool areConcurrent(const Strand &a, const Strand &b) const {
    if (a.call != b.call)
      return areConcurrent(*a.call, *b.call);
    std::vector<const Strand *> x = path(a), y = path(b);
    for (size_t i = 0; i < x.size() && i < y.size(); ++i) {
      if (x[i]->loop != y[i]->loop || x[i]->interval != y[i]->interval)
        return false;
      if (x[i]->iteration != y[i]->iteration)
        return true;
    }
    return false;
  }

private:
  using Set = std::vector<bool>; ///< of stages

  size_t indexOf(const Node *node) const {
    return std::find(nodes.begin(), nodes.end(), node) - nodes.begin();
  }

  /// From the call inwards.
  static std::vector<const Strand *> path(const Strand &strand) {
    std::vector<const Strand *> strands;
    for (const Strand *s = &strand; s->outer; s = s->outer.get())
      strands.insert(strands.begin(), s);
    return strands;
  }

  std::vector<size_t> producersOf(size_t node) const {
    std::vector<size_t> producers;
    for (size_t i = 0; i < nodes.size(); ++i)
      for (const Port &port : nodes[i]->ports)
        if (port.to.front() == nodes[node])
          producers.push_back(i);
    return producers;
  }
  std::vector<size_t> waitedBy(size_t node) const {
    std::vector<size_t> waited;
    for (size_t i = 0; i < nodes.size(); ++i)
      for (const TypeInfo *type : nodes[node]->waitsOn)
        if (nodes[i]->type == type)
          waited.push_back(i);
    return waited;
  }

  /// Adds to `set` a stage and all that is finished when it is.
  void addFinished(size_t node, Set &set) const {
    if (set[node])
      return;
    set[node] = true;
    for (size_t producer : producersOf(node))
      addFinished(producer, set);
    for (size_t waited : waitedBy(node))
      addFinished(waited, set);
  }

  /// done[y] holds the stages that are done before y begins: those that y
  /// itself waits for, and those that all its producers come after.
  void findDone(const std::vector<SourceOf> &sources) {
    size_t n = nodes.size();
    std::vector<Set> own(n, Set(n, false));
    for (size_t y = 0; y < n; ++y) {
      for (size_t waited : waitedBy(y))
        addFinished(waited, own[y]);
      if (nodes[y]->collects())
        for (size_t producer : producersOf(y))
          addFinished(producer, own[y]);
      for (size_t x = 0; x < n; ++x)
        if (component[x] == component[y])
          own[y][x] = false;
    }
    // The greatest solution, because of cycles.
    done.assign(n, Set(n, true));
    for (bool changed = true; changed;) {
      changed = false;
      for (size_t y = 0; y < n; ++y) {
        bool isFed = std::any_of(
            sources.begin(), sources.end(),
            [&](const SourceOf &source) { return source.node == nodes[y]; });
        Set next(n, !isFed);
        for (size_t producer : producersOf(y))
          for (size_t x = 0; x < n; ++x)
            next[x] = next[x] && done[producer][x];
        for (size_t x = 0; x < n; ++x)
          next[x] = (next[x] || own[y][x]) && component[x] != component[y];
        changed = changed || next != done[y];
        done[y] = next;
      }
    }
  }

  /// complete[y] holds the stages whose writes are there when a primitive
  /// arrives at y.
  void findComplete(const std::vector<SourceOf> &sources) {
    size_t n = nodes.size();
    complete.assign(n, Set(n, false));
    for (size_t y = 0; y < n; ++y) {
      if (!producersOf(y).empty())
        continue;
      for (size_t writer : waitedBy(y)) {
        Set feeding(n, false); // the writer and what reaches it by edges
        addProducers(writer, feeding);
        bool isComplete = true;
        for (size_t x = 0; x < n; ++x)
          isComplete = isComplete && !(feeding[x] && nodes[x]->collects());
        for (const SourceOf &early : sources)
          for (const SourceOf &late : sources)
            if (late.node == nodes[y] && feeding[indexOf(early.node)])
              isComplete = isComplete && early.number < late.number;
        complete[y][writer] = isComplete;
      }
    }
  }
  void addProducers(size_t node, Set &set) const {
    if (set[node])
      return;
    set[node] = true;
    for (size_t producer : producersOf(node))
      addProducers(producer, set);
  }

  std::vector<const Node *> nodes;
  std::vector<size_t> component; ///< of each stage
  std::vector<bool> collecting;  ///< whether a component has a stage that does
  std::vector<Set> done, complete;
};

} // namespace piko::reference

#endif // PIKO_REFERENCE_STRAND_H
