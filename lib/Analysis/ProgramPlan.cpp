// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A loop is a cycle of stages that do not collect. It is a component of the
// graph, or a part of one that also has stages that collect. Without its loops,
// and cut where stages collect, the graph has no cycle.

#include "Piko/Analysis/ProgramPlan.h"

#include "Piko/Analysis/OrderFacts.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"

using namespace mlir;
using namespace piko;

ProgramPlan::ProgramPlan(PipelineOp pipeline, RankedEdges ranked)
    : graph(pipeline, getDeclaredStages(pipeline)), components(graph),
      loops(graph.cutAtCollectors()), ranked(ranked), reach(graph.reach()) {
  order = components.declarationOrder();
  for (StageOp stage : graph.stages)
    ordered.push_back(!isOrderIrrelevant(pipeline, stage));
  findEdges(pipeline);
  findKeyed();
  findWidths();
  findBinned(pipeline);
  findGathers();
}

void ProgramPlan::findEdges(PipelineOp pipeline) {
  for (auto [number, source] : llvm::enumerate(pipeline.getOps<SourceOp>()))
    edges.push_back(
        {source, -1, int(number), graph.getNumber(source.getStageAttr())});
  for (auto edge : pipeline.getOps<EdgeOp>())
    edges.push_back({edge, graph.getNumber(edge.getProducerAttr()),
                     int(edge.getPort()),
                     graph.getNumber(edge.getConsumerAttr()), isLocal(edge)});
}

SmallVector<const PlannedEdge *> ProgramPlan::getInputs(int stage) const {
  SmallVector<const PlannedEdge *> inputs;
  for (const PlannedEdge &edge : edges)
    if (edge.consumer == stage)
      inputs.push_back(&edge);
  return inputs;
}

//===----------------------------------------------------------------------===//
// Lineage keys
//===----------------------------------------------------------------------===//

bool ProgramPlan::isInsideLoop(const PlannedEdge &edge) const {
  return edge.producer >= 0 && isLoop(getLoop(edge.producer)) &&
         getLoop(edge.producer) == getLoop(edge.consumer);
}

int ProgramPlan::countInputs(int stage) const {
  int count = 0;
  llvm::DenseSet<std::pair<int, int>> loopsThere; // with the stage
  for (const PlannedEdge &edge : edges) {
    if (getLoop(edge.consumer) != getLoop(stage) || isInsideLoop(edge))
      continue;
    int from = edge.producer < 0 ? -1 : getLoop(edge.producer);
    count += from < 0 || !isLoop(from) ||
             loopsThere.insert({from, edge.consumer}).second;
  }
  return count;
}

bool ProgramPlan::merges(int stage) const {
  // A list shows its order also where that is any.
  return countInputs(stage) > 1 && (ordered[stage] || isLoop(getLoop(stage)) ||
                                    graph.getStage(stage).getTakesList());
}

int64_t &ProgramPlan::widthAt(int stage) {
  int loop = getLoop(stage);
  return isLoop(loop) ? loopKeys[loop] : keeps[stage];
}

bool ProgramPlan::isDivided(int stage) const {
  return ranked.divided && ranked.divided->contains(graph.getStage(stage));
}

bool ProgramPlan::mergesRanks(const PlannedEdge &edge) const {
  return ranked.exchanged && ranked.exchanged->contains(edge.op) &&
         (ordered[edge.consumer] || isLoop(getLoop(edge.consumer)) ||
          graph.getStage(edge.consumer).getTakesList());
}

/// Keys are needed where several edges or sources come into a stage, or into a
/// loop, and on the way there: what goes into a stage, or into a loop, needs
/// keys if what comes out does, unless that starts a new lineage.
void ProgramPlan::findKeyed() {
  keeps.assign(graph.stages.size(), 0);
  loopKeys.assign(loops.nodes.size(), 0);
  for (auto [loop, stages] : llvm::enumerate(loops.nodes))
    if (isLoop(loop) && merges(stages.front()))
      loopKeys[loop] = 1;
  for (bool changed = true; changed;) {
    changed = false;
    for (PlannedEdge &edge : edges) {
      if (edge.keys > 0 || isInsideLoop(edge) ||
          (widthAt(edge.consumer) == 0 && !merges(edge.consumer) &&
           !mergesRanks(edge)))
        continue;
      edge.keys = 1;
      changed = true;
      if (edge.producer >= 0 && !graph.getStage(edge.producer).collects())
        widthAt(edge.producer) = 1;
    }
  }
}

/// A word for a source's primitives, two for what a stage that collects emits,
/// three if ranks share it, one more for each hop; a loop counts as one
/// hop.
void ProgramPlan::findWidths() {
  for (bool changed = true; changed;) {
    changed = false;
    for (PlannedEdge &edge : edges) {
      if (edge.keys == 0)
        continue;
      int64_t width = edge.producer < 0 ? 1
                      : graph.getStage(edge.producer).collects()
                          ? (isDivided(edge.producer) ? 3 : 2)
                          : widthAt(edge.producer) + 1;
      int64_t &kept = widthAt(edge.consumer);
      changed |= width > edge.keys || (kept > 0 && width > kept);
      edge.keys = std::max(edge.keys, width);
      if (kept > 0)
        kept = std::max(kept, width);
    }
  }
}

//===----------------------------------------------------------------------===//
// Order
//===----------------------------------------------------------------------===//

void ProgramPlan::findBinned(PipelineOp pipeline) {
  for (StageOp stage : graph.stages)
    placed.push_back(stage.getPlaced());
  keepsBins.assign(graph.stages.size(), false);
  pipeline.walk([&](AssignOp assign) {
    FlatSymbolRefAttr name = assign.getStageAttr();
    if (!name) // of a stage that no kernel has
      return;
    int stage = graph.getNumber(name);
    bool keeps = true;
    assign.walk([&](AssignmentOpInterface op) { keeps &= op.keepsBin(); });
    keepsBins[stage] = keeps && (keepsBins[stage] || !placed[stage]);
    placed[stage] = true;
  });
}

bool ProgramPlan::keepsBinOrder(const PlannedEdge &edge) const {
  return edge.keys == 0 && keepsBins[edge.consumer] &&
         !graph.getStage(edge.producer).getTile() && binOrder[edge.consumer];
}

bool ProgramPlan::needsBinOrderOnly(const PlannedEdge &edge) const {
  return edge.local || !ordered[edge.consumer] || keepsBinOrder(edge);
}

/// A stage that runs bin by bin emits in the order of bins, which is that of
/// lineage only if it collects, and then only without tiles. But where the bins
/// of the next stage are the same, each gets what it needs in order; that of
/// different bins shows if it does after that stage, unless that one collects.
void ProgramPlan::findGathers() {
  binOrder.assign(graph.stages.size(), true);
  for (bool changed = true; changed;) {
    changed = false;
    for (const PlannedEdge &edge : edges) {
      if (edge.producer < 0 || !binOrder[edge.producer] ||
          graph.getStage(edge.producer).collects() || needsBinOrderOnly(edge))
        continue;
      binOrder[edge.producer] = false;
      changed = true;
    }
  }
  for (PlannedEdge &edge : edges) {
    if (edge.producer < 0 || edge.local)
      continue;
    StageOp from = graph.getStage(edge.producer);
    edge.permute = placed[edge.producer] &&
                   (!from.collects() || from.getTile()) &&
                   ordered[edge.producer] && ordered[edge.consumer] &&
                   !keepsBinOrder(edge);
  }
}
