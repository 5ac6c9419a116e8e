// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-prune-unreached:
//   1. find the stages that a primitive may reach: from sources, along the
//      ports on which something is emitted;
//   2. keep what others depend on: stages that somebody waits for, that run for
//      empty bins, or that with a stage which collects are on one cycle, whose
//      rounds they make;
//   3. take away the others, and the edges on which nothing goes.

#include "Piko/Analysis/PhaseGraph.h"
#include "Piko/Analysis/StageGraph.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Transforms/Passes.h"

#include "llvm/ADT/SetVector.h"

namespace piko {
#define GEN_PASS_DEF_PRUNEUNREACHED
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct PruneUnreachedPass : piko::impl::PruneUnreachedBase<PruneUnreachedPass> {
  void runOnOperation() override;
};

class ReachPruner {
public:
  explicit ReachPruner(PipelineOp pipeline)
      : pipeline(pipeline),
        graph(pipeline, llvm::to_vector(pipeline.getOps<StageOp>())),
        cycles(graph) {}
  void run();

private:
  StageOp getStage(FlatSymbolRefAttr name) {
    return graph.getStage(graph.getNumber(name));
  }
  void keep(StageOp stage);
  void findKept();
  void removeEdges();
  void removeStages();
  bool isUsed(EdgeOp edge);
  bool makesRounds(EdgeOp edge);
  bool isFormal(EdgeOp edge);

  PipelineOp pipeline;
  const StageGraph graph; ///< As it was before edges were removed.
  const NodeGraph cycles;
  llvm::SetVector<Operation *> kept;
  llvm::DenseSet<Operation *> fed; ///< By a source or an edge that is used.
  /// Stages and their ports on which something is emitted.
  llvm::DenseSet<std::pair<Operation *, int64_t>> emitting;
};

} // namespace

/// Whether a stage, or its schedule, may run though no primitive reaches it.
static bool runsUnreached(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  return schedule && (schedule.getEveryBin() || !schedule.getBody().empty());
}

/// A stage is reached, and with it those that it waits for: without them it
/// might not collect.
void ReachPruner::keep(StageOp stage) {
  if (!kept.insert(stage))
    return;
  ScheduleOp schedule = stage.getSchedule();
  if (!schedule || !schedule.getEndStageAttr())
    return;
  for (auto name : schedule.getEndStageAttr().getAsRange<FlatSymbolRefAttr>())
    keep(getStage(name));
}

bool ReachPruner::isUsed(EdgeOp edge) {
  StageOp producer = getStage(edge.getProducerAttr());
  return kept.contains(producer) &&
         emitting.contains({producer, int64_t(edge.getPort())});
}

/// Whether a stage that is kept collects in the rounds of a cycle that the edge
/// is on.
bool ReachPruner::makesRounds(EdgeOp edge) {
  int cycle = cycles.nodeOf[graph.getNumber(edge.getProducerAttr())];
  return cycle == cycles.nodeOf[graph.getNumber(edge.getConsumerAttr())] &&
         llvm::any_of(cycles.nodes[cycle], [&](int member) {
           StageOp stage = graph.getStage(member);
           return kept.contains(stage) && stage.collects();
         });
}

/// Nothing goes along the edge, but its consumer is kept, and needs an edge.
bool ReachPruner::isFormal(EdgeOp edge) {
  StageOp consumer = getStage(edge.getConsumerAttr());
  return kept.contains(consumer) && !fed.contains(consumer);
}

void ReachPruner::findKept() {
  for (auto stage : pipeline.getOps<StageOp>())
    stage.walk([&](EmissionOpInterface emission) {
      emitting.insert({stage, emission.getPort()});
    });
  for (auto source : pipeline.getOps<SourceOp>())
    keep(getStage(source.getStageAttr()));
  for (auto stage : pipeline.getOps<StageOp>())
    if (runsUnreached(stage))
      keep(stage);
  for (size_t before = 0; before != kept.size();) {
    before = kept.size();
    fed.clear();
    for (auto source : pipeline.getOps<SourceOp>())
      fed.insert(getStage(source.getStageAttr()));
    for (auto edge : pipeline.getOps<EdgeOp>())
      if (isUsed(edge)) {
        keep(getStage(edge.getConsumerAttr()));
        fed.insert(getStage(edge.getConsumerAttr()));
      }
    for (auto edge : pipeline.getOps<EdgeOp>())
      if (isFormal(edge) || makesRounds(edge)) {
        keep(getStage(edge.getProducerAttr()));
        keep(getStage(edge.getConsumerAttr()));
      }
  }
}

/// Takes away those on which nothing goes; the ports of others move up.
void ReachPruner::removeEdges() {
  llvm::DenseMap<std::pair<Operation *, int64_t>, EdgeOp> leaving;
  for (auto edge : pipeline.getOps<EdgeOp>())
    leaving[{getStage(edge.getProducerAttr()), int64_t(edge.getPort())}] = edge;
  Builder builder(pipeline.getContext());
  for (auto stage : pipeline.getOps<StageOp>()) {
    SmallVector<Attribute> outputs;
    llvm::DenseMap<int64_t, int64_t> ports;
    for (auto [port, record] : llvm::enumerate(stage.getOutputs())) {
      EdgeOp edge = leaving.at({stage, int64_t(port)});
      if (!isUsed(edge) && !isFormal(edge) && !makesRounds(edge)) {
        edge.erase();
        continue;
      }
      edge.setPort(outputs.size());
      ports[port] = outputs.size();
      outputs.push_back(record);
    }
    if (outputs.size() == stage.getOutputs().size())
      continue;
    stage.setOutputsAttr(builder.getArrayAttr(outputs));
    stage.walk(
        [&](EmitOp emit) { emit.setPort(ports.lookup(emit.getPort())); });
  }
}

void ReachPruner::removeStages() {
  for (auto stage : llvm::to_vector(pipeline.getOps<StageOp>())) {
    if (kept.contains(stage))
      continue;
    stage.emitRemark("stage '")
        << getCppName(stage)
        << "' is removed, because no primitive can reach it";
    stage.erase();
  }
}

void ReachPruner::run() {
  findKept();
  // Ports of emissions get other numbers.
  pipeline.walk([](EmissionOpInterface emission) { asEmit(emission); });
  removeEdges();
  removeStages();
}

void PruneUnreachedPass::runOnOperation() {
  // A run that is checked has all stages that the text has.
  if (!getOperation().getOps<CheckRecordOp>().empty())
    return;
  ReachPruner(getOperation()).run();
}
