// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Analysis/StageGraph.h"

#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

SmallVector<StageOp> piko::getDeclaredStages(PipelineOp pipeline) {
  SmallVector<StageOp> stages(pipeline.getOps<StageOp>());
  if (llvm::all_of(stages, [](StageOp s) { return s.getLineage(); }))
    llvm::sort(stages, [](StageOp a, StageOp b) {
      return *a.getLineage() < *b.getLineage();
    });
  return stages;
}

bool piko::isOnCycle(StageOp stage) {
  llvm::DenseMap<StringAttr, SmallVector<StringAttr, 2>> consumers;
  for (auto edge : getPipeline(stage).getOps<EdgeOp>())
    consumers[edge.getProducerAttr().getAttr()].push_back(
        edge.getConsumerAttr().getAttr());
  llvm::SmallSetVector<StringAttr, 8> reached;
  reached.insert(stage.getSymNameAttr());
  for (size_t i = 0; i < reached.size(); ++i)
    for (StringAttr consumer : consumers.lookup(reached[i])) {
      if (consumer == stage.getSymNameAttr())
        return true;
      reached.insert(consumer);
    }
  return false;
}

StageGraph::StageGraph(PipelineOp pipeline, ArrayRef<StageOp> stages)
    : stages(stages) {
  for (auto [number, stage] : llvm::enumerate(stages))
    numbers[StageOp(stage).getSymNameAttr()] = number;
  consumers.resize(stages.size());
  waits.resize(stages.size());
  SmallVector<EdgeOp> edges(pipeline.getOps<EdgeOp>());
  llvm::sort(edges, [&](EdgeOp a, EdgeOp b) {
    return std::pair(getNumber(a.getProducerAttr()), a.getPort()) <
           std::pair(getNumber(b.getProducerAttr()), b.getPort());
  });
  for (EdgeOp edge : edges)
    consumers[getNumber(edge.getProducerAttr())].push_back(
        getNumber(edge.getConsumerAttr()));
  for (int i = 0, e = stages.size(); i < e; ++i) {
    ScheduleOp schedule = getStage(i).getSchedule();
    if (!schedule || !schedule.getEndStageAttr())
      continue;
    for (auto name : schedule.getEndStageAttr().getAsRange<FlatSymbolRefAttr>())
      waits[i].push_back(getNumber(name));
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

StageGraph StageGraph::cutAtCollectors() const {
  StageGraph result = *this;
  for (SmallVector<int> &list : result.consumers)
    llvm::erase_if(list, [&](int to) { return getStage(to).collects(); });
  for (SmallVector<int> &list : result.waits)
    list.clear();
  return result;
}

NodeGraph::NodeGraph(const StageGraph &graph) {
  SmallVector<SmallVector<bool>> reach = graph.reach();
  nodeOf.assign(graph.stages.size(), -1);
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
