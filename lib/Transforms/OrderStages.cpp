// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-order-stages, after section 5.1 of the paper:
//   1. take the stages of each cycle of edges together, as one node;
//   2. cut the graph of nodes into linear branches;
//   3. sort the branches by the distance of their first node from the drain,
//      farthest first;
//   4. take the first branch all of whose dependencies have been taken, until
//      none is left.

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Transforms/Passes.h"

#include "llvm/ADT/SetVector.h"

namespace piko {
#define GEN_PASS_DEF_ORDERSTAGES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

using Lists = SmallVector<SmallVector<int>>;

/// The stages of a pipeline as numbers, in declaration order.
struct StageGraph {
  SmallVector<StageOp> stages;
  /// For each stage its consumers, in port order, and the stages it waits for.
  Lists consumers, waits;

  explicit StageGraph(PipelineOp pipeline);
  /// Which stages can be reached from each, along one edge or more.
  SmallVector<SmallVector<bool>> reach() const;
};

/// The graph with each cycle as one node: nodes are numbered in the order of
/// their first stages.
struct NodeGraph {
  Lists nodes;              ///< Stages in declaration order.
  SmallVector<bool> cyclic; ///< Whether the node is a cycle.
  /// Between different nodes: consumers in port order, and what must have run
  /// before each.
  Lists consumers, producers, waits;

  explicit NodeGraph(const StageGraph &graph);

  /// Nodes so that each comes behind what it depends on, and otherwise as
  /// declared; fewer than all where nodes wait for each other.
  SmallVector<int> declarationOrder() const;
  /// The longest path from each node to one without consumers, in edges.
  SmallVector<int> distancesFromDrain(ArrayRef<int> order) const;
  Lists branches() const;
  /// Takes branches, farthest from the drain first, as their dependencies
  /// allow; a branch that depends on itself or on others in a circle is left
  /// out.
  SmallVector<int> takeBranches(Lists branches) const;
};

struct OrderStagesPass : piko::impl::OrderStagesBase<OrderStagesPass> {
  void runOnOperation() override;
};

} // namespace

StageGraph::StageGraph(PipelineOp pipeline) {
  llvm::DenseMap<StringAttr, int> number;
  for (auto stage : pipeline.getOps<StageOp>()) {
    number[stage.getSymNameAttr()] = stages.size();
    stages.push_back(stage);
  }
  consumers.resize(stages.size());
  waits.resize(stages.size());
  SmallVector<EdgeOp> edges(pipeline.getOps<EdgeOp>());
  llvm::sort(edges, [&](EdgeOp a, EdgeOp b) {
    return std::pair(number.at(a.getProducerAttr().getAttr()), a.getPort()) <
           std::pair(number.at(b.getProducerAttr().getAttr()), b.getPort());
  });
  for (EdgeOp edge : edges)
    consumers[number.at(edge.getProducerAttr().getAttr())].push_back(
        number.at(edge.getConsumerAttr().getAttr()));
  for (auto [i, stage] : llvm::enumerate(stages)) {
    ScheduleOp schedule = stage.getSchedule();
    if (!schedule || !schedule.getEndStageAttr())
      continue;
    for (auto name : schedule.getEndStageAttr().getAsRange<FlatSymbolRefAttr>())
      waits[i].push_back(number.at(name.getAttr()));
  }
}

SmallVector<SmallVector<bool>> StageGraph::reach() const {
  size_t n = stages.size();
  SmallVector<SmallVector<bool>> reach(n, SmallVector<bool>(n, false));
  for (size_t from = 0; from < n; ++from) {
    SmallVector<int> rest(consumers[from]);
    while (!rest.empty()) {
      int stage = rest.pop_back_val();
      if (reach[from][stage])
        continue;
      reach[from][stage] = true;
      llvm::append_range(rest, consumers[stage]);
    }
  }
  return reach;
}

NodeGraph::NodeGraph(const StageGraph &graph) {
  SmallVector<SmallVector<bool>> reach = graph.reach();
  SmallVector<int> nodeOf(graph.stages.size(), -1);
  for (int i = 0, e = graph.stages.size(); i < e; ++i) {
    if (nodeOf[i] >= 0)
      continue;
    cyclic.push_back(reach[i][i]);
    SmallVector<int> &members = nodes.emplace_back();
    for (int j = i; j < e; ++j)
      if (j == i || (reach[i][j] && reach[j][i])) {
        nodeOf[j] = nodes.size() - 1;
        members.push_back(j);
      }
  }
  consumers.resize(nodes.size());
  producers.resize(nodes.size());
  waits.resize(nodes.size());
  for (int stage = 0, e = graph.stages.size(); stage < e; ++stage) {
    int node = nodeOf[stage];
    for (int consumer : graph.consumers[stage])
      if (nodeOf[consumer] != node) {
        consumers[node].push_back(nodeOf[consumer]);
        producers[nodeOf[consumer]].push_back(node);
      }
    for (int other : graph.waits[stage])
      if (nodeOf[other] != node)
        waits[node].push_back(nodeOf[other]);
  }
}

SmallVector<int> NodeGraph::declarationOrder() const {
  SmallVector<int> order;
  llvm::DenseSet<int> placed;
  auto isPlaced = [&](int node) { return placed.contains(node); };
  auto ready = [&](int node) {
    return !isPlaced(node) && llvm::all_of(producers[node], isPlaced) &&
           llvm::all_of(waits[node], isPlaced);
  };
  for (bool found = true; found;) {
    found = false;
    for (int node = 0, e = nodes.size(); node < e && !found; ++node)
      if (ready(node)) {
        order.push_back(node);
        placed.insert(node);
        found = true;
      }
  }
  return order;
}

SmallVector<int> NodeGraph::distancesFromDrain(ArrayRef<int> order) const {
  SmallVector<int> distance(nodes.size(), 0);
  for (int node : llvm::reverse(order))
    for (int consumer : consumers[node])
      distance[node] = std::max(distance[node], distance[consumer] + 1);
  return distance;
}

Lists NodeGraph::branches() const {
  auto startsBranch = [&](int node) {
    return producers[node].size() != 1 || !waits[node].empty() ||
           consumers[producers[node].front()].size() != 1;
  };
  Lists result;
  for (int start = 0, e = nodes.size(); start < e; ++start) {
    if (!startsBranch(start))
      continue;
    SmallVector<int> &branch = result.emplace_back();
    branch.push_back(start);
    while (consumers[branch.back()].size() == 1 &&
           !startsBranch(consumers[branch.back()].front()))
      branch.push_back(consumers[branch.back()].front());
  }
  return result;
}

SmallVector<int> NodeGraph::takeBranches(Lists branches) const {
  SmallVector<int> taken;
  llvm::DenseSet<int> isTaken;
  auto ready = [&](ArrayRef<int> branch) {
    auto met = [&](int node) {
      return isTaken.contains(node) || llvm::is_contained(branch, node);
    };
    return llvm::all_of(branch, [&](int node) {
      return llvm::all_of(producers[node], met) &&
             llvm::all_of(waits[node], met);
    });
  };
  while (!branches.empty()) {
    auto *next = llvm::find_if(branches, ready);
    if (next == branches.end())
      break;
    taken.append(next->begin(), next->end());
    isTaken.insert(next->begin(), next->end());
    branches.erase(next);
  }
  return taken;
}

/// A stage cannot wait for what cannot be finished before it has run.
static LogicalResult checkWaits(StageGraph &graph) {
  size_t n = graph.stages.size();
  SmallVector<SmallVector<bool>> reach = graph.reach();
  for (size_t stage = 0; stage < n; ++stage)
    for (int other : graph.waits[stage])
      if (other == int(stage) || reach[stage][other]) {
        InFlightDiagnostic error = graph.stages[stage].emitError("stage '")
                                   << getCppName(graph.stages[stage])
                                   << "' waits for stage '"
                                   << getCppName(graph.stages[other])
                                   << "', which cannot finish before it";
        error.attachNote(graph.stages[other].getLoc())
            << "it is fed by stage '" << getCppName(graph.stages[stage]) << "'";
        return error;
      }
  return success();
}

/// Reports nodes that wait for each other.
static void reportCircle(StageGraph &graph, const NodeGraph &nodes,
                         ArrayRef<int> declared) {
  SmallVector<int> rest;
  for (int node = 0, e = nodes.nodes.size(); node < e; ++node)
    if (!llvm::is_contained(declared, node))
      llvm::append_range(rest, nodes.nodes[node]);
  llvm::sort(rest);
  InFlightDiagnostic error = graph.stages[rest.front()].emitError(
      "expected waits that can end, but got a circle of edges and waits among");
  for (int stage : rest)
    error << " '" << getCppName(graph.stages[stage]) << "'";
}

void OrderStagesPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  StageGraph graph(pipeline);
  if (failed(checkWaits(graph)))
    return signalPassFailure();
  NodeGraph nodes(graph);
  SmallVector<int> declared = nodes.declarationOrder();
  if (declared.size() != nodes.nodes.size()) {
    reportCircle(graph, nodes, declared);
    return signalPassFailure();
  }

  SmallVector<int> distance = nodes.distancesFromDrain(declared);
  Lists branches = nodes.branches();
  this->branches = branches.size();
  llvm::sort(branches, [&](ArrayRef<int> a, ArrayRef<int> b) {
    return std::pair(-distance[a.front()], a.front()) <
           std::pair(-distance[b.front()], b.front());
  });
  SmallVector<int> order = nodes.takeBranches(branches);
  // Waits between the middles of branches can leave some of them untaken; the
  // declared order meets all dependencies too.
  if (order.size() != nodes.nodes.size())
    order = declared;

  int64_t place = 0, cycle = 0;
  for (int node : declared) {
    for (int stage : nodes.nodes[node]) {
      graph.stages[stage].setLineage(place++);
      if (nodes.cyclic[node])
        graph.stages[stage].setCycle(cycle);
    }
    cycles += nodes.cyclic[node];
    cycle += nodes.cyclic[node];
  }
  Block *body = pipeline.getBodyBlock();
  for (int node : order)
    for (int stage : nodes.nodes[node])
      graph.stages[stage]->moveBefore(body, body->end());
}
