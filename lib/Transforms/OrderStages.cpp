// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-order-stages, after section 5.1 of the paper:
//   1. cut the graph into linear branches;
//   2. sort the branches by the distance of their first stage from the drain,
//      farthest first;
//   3. take the first branch all of whose dependencies have been taken, until
//      none is left.

#include "Piko/Transforms/Passes.h"

#include "llvm/ADT/SetVector.h"

namespace piko {
#define GEN_PASS_DEF_ORDERSTAGES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// The stages of a pipeline as numbers, in declaration order.
struct StageGraph {
  SmallVector<StageOp> stages;
  /// Consumers, in port order; and for each stage the stages that must have run
  /// before it: its producers, and those it waits for.
  SmallVector<SmallVector<int>> consumers, producers, waits;

  explicit StageGraph(PipelineOp pipeline);

  /// Numbers of the stages so that each comes behind what it depends on, and
  /// otherwise as declared; fewer than all if there is a cycle.
  SmallVector<int> declarationOrder() const;
  /// The longest path from each stage to one without consumers, in edges.
  SmallVector<int> distancesFromDrain(ArrayRef<int> order) const;
  SmallVector<SmallVector<int>> branches() const;
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
  producers.resize(stages.size());
  waits.resize(stages.size());
  SmallVector<EdgeOp> edges(pipeline.getOps<EdgeOp>());
  llvm::sort(edges, [&](EdgeOp a, EdgeOp b) {
    return std::pair(number.at(a.getProducerAttr().getAttr()), a.getPort()) <
           std::pair(number.at(b.getProducerAttr().getAttr()), b.getPort());
  });
  for (EdgeOp edge : edges) {
    int from = number.at(edge.getProducerAttr().getAttr());
    int to = number.at(edge.getConsumerAttr().getAttr());
    consumers[from].push_back(to);
    producers[to].push_back(from);
  }
  for (auto [i, stage] : llvm::enumerate(stages)) {
    ScheduleOp schedule = stage.getSchedule();
    if (!schedule || !schedule.getEndStageAttr())
      continue;
    for (auto name : schedule.getEndStageAttr().getAsRange<FlatSymbolRefAttr>())
      waits[i].push_back(number.at(name.getAttr()));
  }
}

SmallVector<int> StageGraph::declarationOrder() const {
  SmallVector<int> order;
  llvm::DenseSet<int> placed;
  auto ready = [&](int stage) {
    return !placed.contains(stage) &&
           llvm::all_of(producers[stage],
                        [&](int s) { return placed.contains(s); }) &&
           llvm::all_of(waits[stage],
                        [&](int s) { return placed.contains(s); });
  };
  for (bool found = true; found;) {
    found = false;
    for (int stage = 0, e = stages.size(); stage < e && !found; ++stage)
      if (ready(stage)) {
        order.push_back(stage);
        placed.insert(stage);
        found = true;
      }
  }
  return order;
}

SmallVector<int> StageGraph::distancesFromDrain(ArrayRef<int> order) const {
  SmallVector<int> distance(stages.size(), 0);
  for (int stage : llvm::reverse(order))
    for (int consumer : consumers[stage])
      distance[stage] = std::max(distance[stage], distance[consumer] + 1);
  return distance;
}

SmallVector<SmallVector<int>> StageGraph::branches() const {
  auto startsBranch = [&](int stage) {
    return producers[stage].size() != 1 || !waits[stage].empty() ||
           consumers[producers[stage].front()].size() != 1;
  };
  SmallVector<SmallVector<int>> result;
  for (int start = 0, e = stages.size(); start < e; ++start) {
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

/// Takes branches, farthest from the drain first, as their dependencies allow;
/// a branch that depends on itself or on others in a circle is left out.
static SmallVector<int> takeBranches(const StageGraph &graph,
                                     SmallVector<SmallVector<int>> branches) {
  SmallVector<int> taken;
  llvm::DenseSet<int> isTaken;
  auto ready = [&](ArrayRef<int> branch) {
    auto met = [&](int stage) {
      return isTaken.contains(stage) || llvm::is_contained(branch, stage);
    };
    return llvm::all_of(branch, [&](int stage) {
      return llvm::all_of(graph.producers[stage], met) &&
             llvm::all_of(graph.waits[stage], met);
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

void OrderStagesPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  StageGraph graph(pipeline);
  SmallVector<int> declared = graph.declarationOrder();
  if (declared.size() != graph.stages.size()) {
    llvm::SmallSetVector<int, 8> rest;
    for (int i = 0, e = graph.stages.size(); i < e; ++i)
      if (!llvm::is_contained(declared, i))
        rest.insert(i);
    InFlightDiagnostic error = graph.stages[rest.front()].emitError(
        "not supported yet: expected a graph of stages without cycles, but got "
        "a cycle of edges or waits among");
    for (int stage : rest)
      error << " '" << graph.stages[stage].getSymName() << "'";
    return signalPassFailure();
  }

  SmallVector<int> distance = graph.distancesFromDrain(declared);
  SmallVector<SmallVector<int>> branches = graph.branches();
  this->branches = branches.size();
  llvm::sort(branches, [&](ArrayRef<int> a, ArrayRef<int> b) {
    return std::pair(-distance[a.front()], a.front()) <
           std::pair(-distance[b.front()], b.front());
  });
  SmallVector<int> order = takeBranches(graph, branches);
  // Waits between the middles of branches can leave some of them untaken; the
  // declared order meets all dependencies too.
  if (order.size() != graph.stages.size())
    order = declared;

  Builder builder(&getContext());
  for (auto [place, stage] : llvm::enumerate(declared))
    graph.stages[stage].setLineageAttr(builder.getI64IntegerAttr(place));
  Block *body = pipeline.getBodyBlock();
  for (int stage : order)
    graph.stages[stage]->moveBefore(body, body->end());
}
