//===- piko/reference/graph.h - The stages of a pipeline and their order --===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages as the executor sees them, free of their types, and the order in
// which collecting stages run:
//
//   Two stages on a common cycle of edges form one component. The order takes,
//   again and again, the component all of whose producers and waited-for
//   stages outside it are taken, and of several the one with the stage that
//   is declared first. Within a component the stages are in order of
//   declaration.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_GRAPH_H
#define PIKO_REFERENCE_GRAPH_H

#include <piko/reference/error.h>
#include <piko/reference/fiber.h>
#include <piko/reference/grid.h>

#include <cstddef>
#include <functional>
#include <vector>

namespace piko::reference {

class Node;

struct Port {
  const TypeInfo *type;
  std::vector<Node *> to; ///< exactly one in a valid pipeline
};

/// What schedule() said for one bin.
struct BinSchedule {
  int64_t batch = 0;
  bool everyBin = false;
};

/// What schedule() says for all bins or for none.
struct StageSchedule {
  std::vector<const TypeInfo *> waitsOn; ///< endStage
  bool endsBin = false;                  ///< endBin
  bool unordered = false;
  Precision precision = Precision::Strict; ///< of compiled code only
  int64_t ulps = 0;                        ///< likewise; 0: not said
  std::string label;                       ///< specifyName

  /// The directive that another one says differently, or null.
  const char *findOther(const StageSchedule &other) const {
    return !std::is_permutation(waitsOn.begin(), waitsOn.end(),
                                other.waitsOn.begin(), other.waitsOn.end())
               ? "endStage"
           : endsBin != other.endsBin     ? "endBin"
           : unordered != other.unordered ? "specifyOrder"
           : precision != other.precision ? "specifyPrecision"
           : ulps != other.ulps           ? "specifyUlps"
           : label != other.label         ? "specifyName"
                                          : nullptr;
  }
};

/// A stage of a pipeline. Derived classes call the user's three phases.
class Node : public StageSchedule {
public:
  virtual ~Node() = default;
  virtual void assign(const std::byte *primitive) = 0;
  virtual void schedule(int64_t bin) = 0;
  virtual void process(const std::byte *primitive) = 0;
  virtual void processList(const std::byte *primitives, int64_t count) = 0;

  [[noreturn]] void fail(int64_t bin, const std::string &message,
                         const std::string &context = "") const {
    reference::fail(name(), bin, message, context);
  }
  [[noreturn]] void failPort(int64_t bin, int port) const {
    fail(bin, "expected one of the " + std::to_string(ports.size()) +
                  " ports, but got port " + std::to_string(port));
  }
  std::string_view name() const {
    return label.empty() ? type->name : std::string_view(label);
  }

  const void *address = nullptr;  ///< of the user's stage
  size_t size = 0;                ///< its bytes
  const TypeInfo *type = nullptr; ///< the user's stage type
  const TypeInfo *inputType = nullptr;
  size_t inputSize = 0;
  std::vector<Port> ports;
  int rank = 0;
  Cell binSize{1, 1, 1, 1};
  bool takesList = false;

  // Set anew for each run.
  BinGrid grid;
  std::vector<BinSchedule> schedules; ///< one for each bin
  bool collects() const { return takesList || endsBin || !waitsOn.empty(); }
  mutable StackPool stacks; ///< of iterations that meet in a call of Process
  int loop = -1; ///< which cycle of stages that do not collect, or -1
  std::vector<std::vector<std::byte>> collected; ///< primitives of each bin
};

/// A set of stages on a common cycle, or one stage.
struct Component {
  std::vector<Node *> nodes; ///< in order of declaration
  bool cyclic = false;
};

/// The strongly connected components of the stages `nodes` under the edges
/// that `follow` accepts; nodes within a component keep their order.
inline std::vector<Component> findComponents(
    const std::vector<Node *> &nodes,
    const std::function<bool(const Node &from, const Node &to)> &follow) {
  size_t n = nodes.size();
  auto indexOf = [&](const Node *node) {
    return std::find(nodes.begin(), nodes.end(), node) - nodes.begin();
  };
  // Pipelines are small: reachability by repeated relaxation.
  std::vector<std::vector<bool>> reach(n, std::vector<bool>(n, false));
  for (size_t i = 0; i < n; ++i)
    for (const Port &port : nodes[i]->ports)
      for (Node *to : port.to)
        if (follow(*nodes[i], *to))
          reach[i][indexOf(to)] = true;
  for (size_t k = 0; k < n; ++k)
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < n; ++j)
        if (reach[i][k] && reach[k][j])
          reach[i][j] = true;

  std::vector<Component> components;
  std::vector<bool> taken(n, false);
  for (size_t i = 0; i < n; ++i) {
    if (taken[i])
      continue;
    Component &component = components.emplace_back();
    component.cyclic = reach[i][i];
    for (size_t j = i; j < n; ++j)
      if (j == i || (reach[i][j] && reach[j][i])) {
        taken[j] = true;
        component.nodes.push_back(nodes[j]);
      }
  }
  return components;
}

/// The components of the pipeline in stage order. `nodes` are in order of
/// declaration.
inline std::vector<Component> orderStages(const std::vector<Node *> &nodes) {
  std::vector<Component> rest =
      findComponents(nodes, [](const Node &, const Node &) { return true; });
  auto holds = [](const Component &component, const Node *node) {
    return std::find(component.nodes.begin(), component.nodes.end(), node) !=
           component.nodes.end();
  };
  auto isPending = [&](const Node *node, const Component &self) {
    return !holds(self, node) &&
           std::any_of(rest.begin(), rest.end(), [&](const Component &other) {
             return holds(other, node);
           });
  };
  // The first stage that `component` still has to wait for.
  auto blocker = [&](const Component &component) -> const Node * {
    for (const Node *node : nodes) {
      for (const Port &port : node->ports)
        for (const Node *to : port.to)
          if (holds(component, to) && isPending(node, component))
            return node;
      for (const Node *waiting : component.nodes)
        for (const TypeInfo *type : waiting->waitsOn)
          if (node->type == type && isPending(node, component))
            return node;
    }
    return nullptr;
  };

  std::vector<Component> order;
  while (!rest.empty()) {
    auto next = std::find_if(rest.begin(), rest.end(),
                             [&](const Component &c) { return !blocker(c); });
    if (next == rest.end()) {
      for (const Component &component : rest)
        for (const Node *node : component.nodes)
          if (!node->waitsOn.empty())
            node->fail(-1, "waits for stage '" +
                               std::string(node->waitsOn.front()->name) +
                               "', which cannot finish before it");
    }
    Component taken = std::move(*next);
    rest.erase(next);
    order.push_back(std::move(taken));
  }
  return order;
}

} // namespace piko::reference

#endif // PIKO_REFERENCE_GRAPH_H
