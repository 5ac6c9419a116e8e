// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-partition-program:
//   1. take strips apart that have cycles, as ranks would meet in each wave, or
//      that something leaves;
//   2. find who runs each kernel, and say so;
//   3. make exchanges of the edges that lead from one rank to another;
//   4. give keys to what is exchanged, and to what leads there;
//   5. bring state together where ranks use what others have written.

#include "Ranks/Partition.h"

#include "Support/StateAccess.h"

#include "Piko/Analysis/OrderFacts.h"
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

  void prepareStrips();
  void divide();
  void exchange();
  void setKeys();

  Divisions divisions;
  unsigned divided = 0, replicated = 0, exchanges = 0;

private:
  template <class Function> void forStatements(Function function);
  void divide(LaunchOp launch);
  void divide(WavesOp waves);
  void set(LaunchOp launch, RankDivision division, const std::string &why);
  std::string whyNotDivided(LaunchOp launch);
  bool isReplicated(LaunchOp launch, RankDivision division);
  void findRankOrder();
  void exchange(OpOperand &operand, RankDivision to);
  void exchangeBins(OpOperand &operand, LaunchOp assign, RankDivision to);
  bool keepsBin(EdgeOp edge);
  bool staysInBin(EdgeOp edge);
  RankDivision findDivision(ArrayRef<LaunchOp> loop, std::string &why);
  RankDivision divisionOf(StageOp stage) {
    return divisions.lookup(stage).division;
  }

  ProgramOp program;
  PipelineOp pipeline;
  OpBuilder builder;
  llvm::DenseSet<Operation *> exchanged; ///< Edges of the pipeline, with keys.
  /// Stages divided by the primitives of this one source: what a rank emits is
  /// before what the next one does.
  llvm::DenseMap<Operation *, Operation *> rankOrder;
};

} // namespace

Operation *piko::takeApart(StripsOp strips) {
  Block &body = strips.getBody().front();
  Operation *first = &body.front();
  auto leave = cast<LeaveOp>(body.getTerminator());
  for (auto [result, value] : llvm::zip(strips.getEdges(), leave.getLeaving()))
    result.replaceAllUsesWith(value);
  body.getArgument(0).replaceAllUsesWith(strips.getSource());
  if (first == leave)
    first = strips->getNextNode();
  leave.erase();
  strips->getBlock()->getOperations().splice(strips->getIterator(),
                                             body.getOperations());
  strips.erase();
  return first;
}

/// Why ranks do not run strips, or nothing. What leaves strips would wait for
/// the last one, with keys.
static StringRef whyNoStrips(StripsOp strips) {
  Block &body = strips.getBody().front();
  if (!body.getOps<WavesOp>().empty() || !body.getOps<RoundsOp>().empty())
    return "they would meet in each wave of a cycle";
  return strips.getNumResults() > 0
             ? "what leaves a strip would wait for the last one"
             : "";
}

/// How long a strip is, ranks agree on when they run.
void Partitioner::prepareStrips() {
  for (auto strips :
       llvm::make_early_inc_range(program.getBodyBlock()->getOps<StripsOp>())) {
    strips.removeChunkAttr();
    StringRef why = whyNoStrips(strips);
    if (why.empty())
      continue;
    strips.emitRemark() << "ranks run no strips of the source, as " << why;
    takeApart(strips);
  }
}

/// Calls a function for each statement, those of strips among them.
template <class Function> void Partitioner::forStatements(Function function) {
  for (Operation &op : llvm::make_early_inc_range(*program.getBodyBlock())) {
    function(op);
    if (auto strips = dyn_cast<StripsOp>(op))
      for (Operation &inner :
           llvm::make_early_inc_range(strips.getBody().front()))
        function(inner);
  }
}

//===----------------------------------------------------------------------===//
// Who runs a kernel
//===----------------------------------------------------------------------===//

/// What shows, in kernels, in which order all calls of their stages run.
static std::string whyShowsOrder(ArrayRef<LaunchOp> launches) {
  std::string reason;
  llvm::DenseMap<std::pair<Attribute, Attribute>, AtomicKind> kinds;
  for (LaunchOp launch : launches)
    launch.getKernelOp().walk([&](AtomicOp atomic) {
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

/// Whether a loop reads what it writes elsewhere than in the bin of a call:
/// ranks see that at its end alone.
static bool readsOwnState(ArrayRef<LaunchOp> launches) {
  llvm::DenseMap<Attribute, int> kinds;
  llvm::DenseSet<Attribute> elsewhere;
  for (LaunchOp launch : launches)
    launch.getKernelOp().walk([&](Operation *op) {
      auto [state, access] = getStateAccess(op);
      if (!state)
        return;
      kinds[state] |= access;
      if (!isInBin(op))
        elsewhere.insert(state);
    });
  return llvm::any_of(kinds, [&](const auto &state) {
    return (state.second & StateAccess::reads) &&
           (state.second & ~StateAccess::reads) &&
           elsewhere.contains(state.first);
  });
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

/// Why a stage runs on the first rank, whatever its bins are.
std::string Partitioner::whyNotDivided(LaunchOp launch) {
  StageOp stage = getStages(launch.getKernelOp()).front();
  if (!pipeline.getOps<CheckRecordOp>().empty())
    return "the pipeline checks itself, in the order of one process";
  if (launch->getParentOfType<RoundsOp>())
    return "it is on a cycle with stages that wait";
  ScheduleOp schedule = stage.getSchedule();
  if (schedule && schedule.getAfter())
    return "it follows another stage";
  return whyShowsOrder(launch);
}

/// Whether all ranks run what a kernel does for a source, because others need
/// it and it would take longer to bring it to them. Nothing but state tells of
/// such a kernel.
bool Partitioner::isReplicated(LaunchOp launch, RankDivision division) {
  KernelOp kernel = launch.getKernelOp();
  auto join = launch.getInput().getDefiningOp<JoinOp>();
  if (!isa<ProgramOp, StripsOp>(launch->getParentOp()) ||
      launch.getNumResults() > 0 || !join || division != RankDivision::Parts)
    return false;
  for (Value edge : join.getEdges())
    if (!isa_and_nonnull<SourceOp>(getOrigin(edge)))
      return false;
  llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
  bool isNeeded = false;
  program.walk([&](LaunchOp other) {
    if (other != launch)
      other.getKernelOp().walk([&](Operation *op) {
        auto [state, kinds] = getStateAccess(op);
        isNeeded |= state && written.contains(state.getAttr());
      });
  });
  return isNeeded && isCheaperThanItsStores(kernel);
}

/// Neighbouring bins belong to one rank, as to one core.
static RankOwners getOwners(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  return schedule && schedule.getKind() == ScheduleKind::DirectMap
             ? RankOwners::Blocks
             : RankOwners::Pattern;
}

void Partitioner::set(LaunchOp launch, RankDivision division,
                      const std::string &why) {
  SmallVector<StageOp> stages = getStages(launch.getKernelOp());
  StageOp stage = stages.front();
  bool isMapped =
      division == RankDivision::Bins && getOwners(stage) != RankOwners::Pattern;
  RankOwners owners =
      division == RankDivision::Bins ? getOwners(stage) : RankOwners::Pattern;
  for (StageOp member : stages)
    divisions[member] = {division, owners};
  if (division == RankDivision::First) {
    stage.emitRemark() << "stage '" << getCppName(stage)
                       << "' runs on the first rank alone: " << why;
    return;
  }
  if (division == RankDivision::All) {
    ++replicated;
    stage.emitRemark() << "stage '" << getCppName(stage)
                       << "' runs on each rank, as it costs more to send what "
                          "it stores";
  } else {
    ++divided;
  }
  builder.setInsertionPointToStart(program.getBodyBlock());
  auto kind = RankDivisionAttr::get(builder.getContext(), division);
  RankOwnersAttr mapped =
      isMapped ? RankOwnersAttr::get(builder.getContext(), owners)
               : RankOwnersAttr();
  for (StageOp member : llvm::reverse(stages))
    PartitionOp::create(builder, launch.getLoc(),
                        FlatSymbolRefAttr::get(member.getSymNameAttr()), kind,
                        mapped);
}

void Partitioner::divide(LaunchOp launch) {
  SmallVector<StageOp> stages = getStages(launch.getKernelOp());
  if (stages.empty())
    return;
  std::string why = whyNotDivided(launch);
  RankDivision division = RankDivision::First;
  if (why.empty() && !stages.front().isWholeDomain()) {
    division = RankDivision::Bins;
  } else if (why.empty()) {
    why = whyNotParts(stages.front(), launch.getKernelOp());
    if (why.empty())
      division = RankDivision::Parts;
  }
  set(launch, isReplicated(launch, division) ? RankDivision::All : division,
      why);
}

/// How a loop is divided that is several loops: each rank has the primitives
/// that have come to it, and all that follow from them. That is so if all calls
/// may run anywhere, and if all bins are of one size and nothing leaves its
/// bin.
RankDivision Partitioner::findDivision(ArrayRef<LaunchOp> loop,
                                       std::string &why) {
  why = whyShowsOrder(loop);
  if (why.empty() && readsOwnState(loop))
    why = "it is on a cycle that reads what it writes";
  llvm::DenseSet<Operation *> members;
  for (LaunchOp launch : loop) {
    if (why.empty())
      why = whyNotDivided(launch);
    for (StageOp stage : getStages(launch.getKernelOp()))
      members.insert(stage);
  }
  if (!why.empty())
    return RankDivision::First;
  StageOp first = getStages(LaunchOp(loop.front()).getKernelOp()).front();
  if (!first.isWholeDomain()) {
    for (auto edge : pipeline.getOps<EdgeOp>()) {
      auto to = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
      if (!members.contains(
              lookupInPipeline<StageOp>(edge, edge.getProducerAttr())) ||
          (!members.contains(to) && isOrderIrrelevant(pipeline, to)))
        continue;
      if (to.getBins() != first.getBins() ||
          getOwners(to) != getOwners(first) || !keepsBin(edge))
        why = "it is on a cycle in which primitives come to other bins";
    }
    return why.empty() ? RankDivision::Bins : RankDivision::First;
  }
  for (LaunchOp launch : loop)
    if (why.empty())
      why = whyNotParts(getStages(launch.getKernelOp()).front(),
                        launch.getKernelOp());
  return why.empty() ? RankDivision::Parts : RankDivision::First;
}

void Partitioner::divide(WavesOp waves) {
  SmallVector<LaunchOp> launches = llvm::to_vector(waves.getOps<LaunchOp>());
  std::string why;
  RankDivision division = findDivision(launches, why);
  for (LaunchOp launch : llvm::reverse(launches))
    set(launch, division, why);
}

void Partitioner::divide() {
  SmallVector<Operation *> units; // launches, and loops as a whole
  program.walk<WalkOrder::PreOrder>([&](Operation *op) {
    bool isLoop = isa<WavesOp>(op) && !op->getParentOfType<RoundsOp>();
    if (isLoop || isa<LaunchOp>(op))
      units.push_back(op);
    return isLoop ? WalkResult::skip() : WalkResult::advance();
  });
  for (Operation *unit : llvm::reverse(units))
    if (auto waves = dyn_cast<WavesOp>(unit))
      divide(waves);
    else
      divide(cast<LaunchOp>(unit));
  findRankOrder();
}

/// Parts of a source, or of a strip of it, are consecutive, and so is what
/// follows from them.
void Partitioner::findRankOrder() {
  forStatements([&](Operation &op) {
    if (!isa<JoinOp, WavesOp>(op))
      return;
    llvm::SmallPtrSet<Operation *, 2> roots;
    for (Value edge : op.getOperands()) {
      Operation *origin = getOrigin(edge);
      auto from = dyn_cast_or_null<EdgeOp>(origin);
      roots.insert(from ? rankOrder.lookup(lookupInPipeline<StageOp>(
                              from, from.getProducerAttr()))
                        : origin);
    }
    if (roots.size() != 1 || !*roots.begin())
      return;
    auto note = [&](StageOp stage) {
      if (divisionOf(stage) == RankDivision::Parts)
        rankOrder[stage] = *roots.begin();
    };
    if (auto join = dyn_cast<JoinOp>(op)) {
      for (Operation *user : join.getBins().getUsers())
        if (auto launch = dyn_cast<LaunchOp>(user))
          llvm::for_each(getStages(launch.getKernelOp()), note);
    } else {
      for (auto launch : cast<WavesOp>(op).getOps<LaunchOp>())
        llvm::for_each(getStages(launch.getKernelOp()), note);
    }
  });
}

//===----------------------------------------------------------------------===//
// Edges between ranks
//===----------------------------------------------------------------------===//

bool piko::haveSameOwners(StageOp a, StageOp b, const Divisions &divisions) {
  return a.getBins() == b.getBins() &&
         divisions.lookup(a).owners == divisions.lookup(b).owners;
}

/// Whether what comes along an edge is in the bin in which it was emitted.
bool Partitioner::keepsBin(EdgeOp edge) {
  bool keeps = true, isAssigned = false;
  pipeline.walk([&](AssignOp assign) {
    if (assign.getStageAttr() != edge.getConsumerAttr())
      return;
    isAssigned = true;
    assign.walk([&](AssignmentOpInterface op) { keeps &= op.keepsBin(); });
  });
  return keeps && isAssigned;
}

/// Whether its owner has it, too.
bool Partitioner::staysInBin(EdgeOp edge) {
  auto from = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
  auto to = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
  return divisionOf(from) == RankDivision::Bins &&
         divisionOf(to) == RankDivision::Bins &&
         haveSameOwners(from, to, divisions) && keepsBin(edge);
}

/// Who looks at all primitives of a source finds those of its own bins. Where
/// that takes long each rank finds the bins of a part.
void Partitioner::exchangeBins(OpOperand &operand, LaunchOp assign,
                               RankDivision to) {
  if (to != RankDivision::Bins || isCheaperThanItsBins(assign.getKernelOp()))
    return;
  builder.setInsertionPoint(operand.getOwner());
  Value value = operand.get();
  operand.set(
      ExchangeOp::create(builder, assign.getLoc(), value.getType(), value));
  ++exchanges;
}

void Partitioner::exchange(OpOperand &operand, RankDivision to) {
  if (auto assign = operand.get().getDefiningOp<LaunchOp>();
      assign && getAssignedSource(assign.getKernelOp()))
    return exchangeBins(operand, assign, to);
  auto edge = dyn_cast_or_null<EdgeOp>(getOrigin(operand.get()));
  if (!edge || to == RankDivision::Parts)
    return;
  auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
  RankDivision from = divisionOf(producer);
  if ((to == RankDivision::First && from == RankDivision::First) ||
      staysInBin(edge))
    return;
  builder.setInsertionPoint(operand.getOwner());
  Value value = operand.get();
  operand.set(
      ExchangeOp::create(builder, edge.getLoc(), value.getType(), value));
  ++exchanges;
  if (from != RankDivision::First && !rankOrder.contains(producer))
    exchanged.insert(edge);
}

void Partitioner::exchange() {
  forStatements([&](Operation &op) {
    RankDivision to = RankDivision::First; // of cycles that are not divided
    if (auto join = dyn_cast<JoinOp>(op))
      to = divisionOf(join.getStageOp());
    else if (auto waves = dyn_cast<WavesOp>(op))
      to = divisionOf(
          getStages((*waves.getOps<LaunchOp>().begin()).getKernelOp()).front());
    else if (!isa<RoundsOp>(op))
      return;
    for (OpOperand &operand : op.getOpOperands())
      exchange(operand, to);
  });
}

//===----------------------------------------------------------------------===//
// Keys
//===----------------------------------------------------------------------===//

void Partitioner::setKeys() {
  llvm::DenseSet<Operation *> divided;
  for (const auto &[stage, how] : divisions)
    if (how.division != RankDivision::First)
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
  partitioner.prepareStrips();
  partitioner.divide();
  partitioner.exchange();
  partitioner.setKeys();
  shareState(program, partitioner.divisions);
  divided += partitioner.divided;
  replicated += partitioner.replicated;
  exchanges += partitioner.exchanges;
}
