// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-partition-program:
//   1. take strips apart, as ranks meet between the launches of a strip;
//   2. find who runs each kernel, and say so;
//   3. make exchanges of the edges that lead from one rank to another;
//   4. give keys to what is exchanged, and to what leads there;
//   5. bring state together where ranks use what others have written.

#include "Ranks/Partition.h"

#include "Piko/Analysis/ProgramPlan.h"
#include "Piko/Analysis/StageGraph.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Transforms/Passes.h"

namespace piko {
#define GEN_PASS_DEF_PARTITIONPROGRAM
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct PartitionProgramPass
    : piko::impl::PartitionProgramBase<PartitionProgramPass> {
  void runOnOperation() override;
};

class Partitioner {
public:
  explicit Partitioner(ProgramOp program)
      : program(program), pipeline(getPipeline(program)),
        builder(program.getContext()) {}

  void takeStripsApart();
  void divide();
  void exchange();
  void setKeys();

  Divisions divisions;
  unsigned divided = 0, exchanges = 0;

private:
  void divide(LaunchOp launch);
  void exchange(OpOperand &operand, Division to);
  bool staysInBin(EdgeOp edge);

  ProgramOp program;
  PipelineOp pipeline;
  OpBuilder builder;
  llvm::DenseSet<Operation *> exchanged; ///< Edges of the pipeline.
};

} // namespace

void Partitioner::takeStripsApart() {
  for (auto strips :
       llvm::make_early_inc_range(program.getBodyBlock()->getOps<StripsOp>())) {
    Block &body = strips.getBody().front();
    auto leave = cast<LeaveOp>(body.getTerminator());
    for (auto [result, value] :
         llvm::zip(strips.getEdges(), leave.getLeaving()))
      result.replaceAllUsesWith(value);
    body.getArgument(0).replaceAllUsesWith(strips.getSource());
    leave.erase();
    strips->getBlock()->getOperations().splice(strips->getIterator(),
                                               body.getOperations());
    strips.erase();
  }
}

//===----------------------------------------------------------------------===//
// Who runs a kernel
//===----------------------------------------------------------------------===//

/// What shows, in a kernel, in which order all calls of a stage run.
static std::string whyShowsOrder(KernelOp kernel) {
  std::string reason;
  llvm::DenseMap<std::pair<Attribute, Attribute>, AtomicKind> kinds;
  kernel.walk([&](AtomicOp atomic) {
    auto [known, isNew] = kinds.try_emplace(
        {atomic.getStateAttr(), atomic.getFieldAttr()}, atomic.getKind());
    if (atomic.getOld())
      reason = "it uses what an atomic operation returns";
    else if (atomic.getKind() == AtomicKind::AddF)
      reason = "it adds floats, whose sum depends on the order";
    else if (known->second != atomic.getKind())
      reason = "it changes one field by two kinds of atomic operations";
  });
  return reason;
}

/// Whether all that comes to a stage is of one source, of which each rank has
/// consecutive primitives: then ranks are in the order of lineage.
static bool isFedByOneSource(StageOp stage) {
  int64_t sources = 0, edges = 0;
  for (Operation &op : *getPipeline(stage).getBodyBlock()) {
    if (auto source = dyn_cast<SourceOp>(op))
      sources += source.getStage() == stage.getSymName();
    else if (auto edge = dyn_cast<EdgeOp>(op))
      edges += edge.getConsumer() == stage.getSymName();
  }
  return sources == 1 && edges == 0;
}

/// Why a kernel whose bin is the whole domain is not divided by primitives.
static std::string whyNotParts(StageOp stage, KernelOp kernel) {
  if (stage.getTakesList() || (stage.collects() && !isFedByOneSource(stage)))
    return "its only bin is the whole domain, and must be complete; give it "
           "bins of a size";
  if (!kernel.getOps<LocalBarrierOp>().empty())
    return "a stage in its kernel waits for its only bin";
  bool updates = false;
  kernel.walk([&](UpdateOp) { updates = true; });
  if (updates || stage.getTile())
    return "it updates pixels, and its only bin is the whole domain; give it "
           "bins of a size";
  return "";
}

void Partitioner::divide(LaunchOp launch) {
  KernelOp kernel = launch.getKernelOp();
  SmallVector<StageOp> stages = getStages(kernel);
  if (stages.empty())
    return;
  StageOp stage = stages.front();
  std::string why;
  if (!pipeline.getOps<CheckRecordOp>().empty())
    why = "the pipeline checks itself, in the order of one process";
  else if (launch->getParentOp() != program)
    why = "it is on a cycle";
  else if (ScheduleOp schedule = stage.getSchedule();
           schedule && schedule.getAfter())
    why = "it follows another stage";
  else
    why = whyShowsOrder(kernel);
  Division division = Division::First;
  if (why.empty() && !stage.isWholeDomain()) {
    division = Division::Bins;
  } else if (why.empty()) {
    why = whyNotParts(stage, kernel);
    if (why.empty())
      division = Division::Parts;
  }
  for (StageOp member : stages)
    divisions[member] = division;
  if (division == Division::First) {
    stage.emitRemark() << "stage '" << getCppName(stage)
                       << "' runs on the first rank alone: " << why;
    return;
  }
  ++divided;
  builder.setInsertionPointToStart(program.getBodyBlock());
  UnitAttr parts =
      division == Division::Parts ? builder.getUnitAttr() : UnitAttr();
  for (StageOp member : llvm::reverse(stages))
    PartitionOp::create(builder, launch.getLoc(),
                        FlatSymbolRefAttr::get(member.getSymNameAttr()), parts);
}

void Partitioner::divide() {
  SmallVector<LaunchOp> launches;
  program.walk([&](LaunchOp launch) { launches.push_back(launch); });
  for (LaunchOp launch : llvm::reverse(launches))
    divide(launch);
}

//===----------------------------------------------------------------------===//
// Edges between ranks
//===----------------------------------------------------------------------===//

/// Whether what comes along an edge is in the bin in which it was emitted, so
/// that its owner has it.
bool Partitioner::staysInBin(EdgeOp edge) {
  auto from = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
  auto to = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
  if (divisions.lookup(from) != Division::Bins ||
      from.getBins() != to.getBins())
    return false;
  bool stays = true, isAssigned = false;
  pipeline.walk([&](AssignOp assign) {
    if (assign.getStageAttr() != edge.getConsumerAttr())
      return;
    isAssigned = true;
    assign.walk([&](AssignmentOpInterface op) { stays &= op.keepsBin(); });
  });
  return stays && isAssigned;
}

void Partitioner::exchange(OpOperand &operand, Division to) {
  auto edge = dyn_cast_or_null<EdgeOp>(getOrigin(operand.get()));
  if (!edge || to == Division::Parts)
    return;
  auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
  Division from = divisions.lookup(producer);
  if ((to == Division::First && from == Division::First) || staysInBin(edge))
    return;
  builder.setInsertionPoint(operand.getOwner());
  Value value = operand.get();
  operand.set(
      ExchangeOp::create(builder, edge.getLoc(), value.getType(), value));
  ++exchanges;
  if (from != Division::First)
    exchanged.insert(edge);
}

void Partitioner::exchange() {
  for (Operation &op : llvm::make_early_inc_range(*program.getBodyBlock())) {
    Division to = Division::First; // of cycles
    if (auto join = dyn_cast<JoinOp>(op))
      to = divisions.lookup(join.getStageOp());
    else if (!isa<WavesOp, RoundsOp>(op))
      continue;
    for (OpOperand &operand : op.getOpOperands())
      exchange(operand, to);
  }
}

//===----------------------------------------------------------------------===//
// Keys
//===----------------------------------------------------------------------===//

void Partitioner::setKeys() {
  llvm::DenseSet<Operation *> divided;
  for (auto [stage, division] : divisions)
    if (division != Division::First)
      divided.insert(stage);
  ProgramPlan plan(pipeline, {&exchanged, &divided});
  program.walk([&](JoinOp join) {
    int stage = plan.graph.getNumber(join.getStageAttr());
    SmallVector<int64_t> keys(join.getKeys());
    for (auto [edge, width] : llvm::zip(join.getEdges(), keys)) {
      Operation *origin = getOrigin(edge);
      for (const PlannedEdge &planned : plan.edges)
        if (planned.op == origin)
          width = planned.keys;
    }
    join.setKeys(keys);
    if (plan.keeps[stage] > 0)
      join.setKeeps(plan.keeps[stage]);
  });
  program.walk([&](WavesOp waves) {
    auto join = *waves.getOps<JoinOp>().begin();
    int loop = plan.getLoop(plan.graph.getNumber(join.getStageAttr()));
    if (plan.loopKeys[loop] > 0)
      waves.setKeys(plan.loopKeys[loop]);
  });
}

void PartitionProgramPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  ProgramOp program = getProgram(pipeline);
  if (!program) {
    pipeline.emitError("expected a piko.program, which piko-form-program "
                       "makes");
    return signalPassFailure();
  }
  if (program.getRanks())
    return markAllAnalysesPreserved();
  program.setRanks(true);
  Partitioner partitioner(program);
  partitioner.takeStripsApart();
  partitioner.divide();
  partitioner.exchange();
  partitioner.setKeys();
  shareState(program, partitioner.divisions);
  divided += partitioner.divided;
  exchanges += partitioner.exchanges;
}
