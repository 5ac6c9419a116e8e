// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-order-stages, after section 5.1 of the paper:
//   1. take the stages of each cycle of edges together, as one node;
//   2. cut the graph of nodes into linear branches;
//   3. sort the branches by the distance of their first node from the drain,
//      farthest first;
//   4. take the first branch all of whose dependencies have been taken, until
//      none is left.

#include "Piko/Analysis/StageGraph.h"
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

/// The nodes of a graph in the order in which they run.
class NodeOrder {
public:
  explicit NodeOrder(const NodeGraph &graph) : graph(graph) {}

  /// The longest path from each node to one without consumers, in edges.
  SmallVector<int> distancesFromDrain(ArrayRef<int> order) const;
  Lists branches() const;
  /// Takes branches, farthest from the drain first, as their dependencies
  /// allow; a branch that depends on itself or on others in a circle is left
  /// out.
  SmallVector<int> takeBranches(Lists branches) const;

private:
  const NodeGraph &graph;
};

struct OrderStagesPass : piko::impl::OrderStagesBase<OrderStagesPass> {
  void runOnOperation() override;
};

} // namespace

SmallVector<int> NodeOrder::distancesFromDrain(ArrayRef<int> order) const {
  SmallVector<int> distance(graph.nodes.size(), 0);
  for (int node : llvm::reverse(order))
    for (int consumer : graph.consumers[node])
      distance[node] = std::max(distance[node], distance[consumer] + 1);
  return distance;
}

Lists NodeOrder::branches() const {
  auto startsBranch = [&](int node) {
    return graph.producers[node].size() != 1 || !graph.waits[node].empty() ||
           graph.consumers[graph.producers[node].front()].size() != 1;
  };
  Lists result;
  for (int start = 0, e = graph.nodes.size(); start < e; ++start) {
    if (!startsBranch(start))
      continue;
    SmallVector<int> &branch = result.emplace_back();
    branch.push_back(start);
    while (graph.consumers[branch.back()].size() == 1 &&
           !startsBranch(graph.consumers[branch.back()].front()))
      branch.push_back(graph.consumers[branch.back()].front());
  }
  return result;
}

SmallVector<int> NodeOrder::takeBranches(Lists branches) const {
  SmallVector<int> taken;
  llvm::DenseSet<int> isTaken;
  auto ready = [&](ArrayRef<int> branch) {
    auto met = [&](int node) {
      return isTaken.contains(node) || llvm::is_contained(branch, node);
    };
    return llvm::all_of(branch, [&](int node) {
      return llvm::all_of(graph.producers[node], met) &&
             llvm::all_of(graph.waits[node], met);
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
  StageGraph graph(pipeline, llvm::to_vector(pipeline.getOps<StageOp>()));
  if (failed(checkWaits(graph)))
    return signalPassFailure();
  NodeGraph nodes(graph);
  SmallVector<int> declared = nodes.declarationOrder();
  if (declared.size() != nodes.nodes.size()) {
    reportCircle(graph, nodes, declared);
    return signalPassFailure();
  }

  NodeOrder paper(nodes);
  SmallVector<int> distance = paper.distancesFromDrain(declared);
  Lists branches = paper.branches();
  llvm::sort(branches, [&](ArrayRef<int> a, ArrayRef<int> b) {
    return std::pair(-distance[a.front()], a.front()) <
           std::pair(-distance[b.front()], b.front());
  });
  SmallVector<int> order = paper.takeBranches(branches);
  // Waits between the middles of branches can leave some of them untaken; the
  // declared order meets all dependencies too.
  if (order.size() != nodes.nodes.size())
    order = declared;

  int64_t place = 0;
  for (int node : declared)
    for (int stage : nodes.nodes[node])
      graph.stages[stage].setLineage(place++);
  Block *body = pipeline.getBodyBlock();
  for (int node : order)
    for (int stage : nodes.nodes[node])
      graph.stages[stage]->moveBefore(body, body->end());
}
