// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-fuse-kernels, for each kernel and each one after it, in order:
//   1. find out whether the former's stages, which become more, feed the
//      latter's and it waits for a bin;
//   2. check that their bins are the same, on the same core, and that nothing
//      sees that the latter runs earlier;
//   3. append it, after a local barrier.
// As many successive stages as possible so run for one bin before the next. The
// kernel break stays
//   - for a stage that waits with end_stage for what runs later than its
//     producer, or that runs for empty bins after a list that does not;
//   - between stages of which one writes state that another one uses. No kernel
//     is moved past another such one, unless both only change it atomically.
//     Two stages of one kernel may update the same image.

#include "Piko/Analysis/BinIdentity.h"
#include "Piko/Analysis/PhaseGraph.h"
#include "Piko/Analysis/StageGraph.h"
#include "Support/StateAccess.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Transforms/Passes.h"

#include "llvm/ADT/MapVector.h"

namespace piko {
#define GEN_PASS_DEF_FUSEKERNELS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// An edge into a stage that waits, and the kernels at its ends.
struct Candidate {
  EdgeOp edge;
  StageOp producer, consumer;
  KernelOp host, kernel;

  LogicalResult check(Refusal &refusal);
  void fuse();

private:
  LogicalResult checkBins(Refusal &refusal);
  LogicalResult checkSchedules(Refusal &refusal);
  LogicalResult checkAssign(Refusal &refusal);
  LogicalResult checkWaits(Refusal &refusal);
  LogicalResult checkState(Refusal &refusal);
  /// The stage whose bins the kernel's loop goes through.
  StageOp head() { return getPhaseStage(host.getProcess()); }
};

struct FuseKernelsPass : piko::impl::FuseKernelsBase<FuseKernelsPass> {
  void runOnOperation() override;

private:
  void fuseInto(KernelOp host);

  llvm::DenseMap<Attribute, SmallVector<EdgeOp, 2>> edgesInto;
};

} // namespace

static LogicalResult refuse(Refusal &refusal, Operation *at, const Twine &why) {
  refusal = {at, why.str()};
  return failure();
}

/// The kernel that holds a stage's process phase.
static KernelOp findKernel(StageOp stage) {
  for (auto kernel : getPipeline(stage).getOps<KernelOp>())
    for (auto process : kernel.getOps<ProcessOp>())
      if (getPhaseStage(process) == stage)
        return kernel;
  return {};
}

static bool waitsForBin(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  return stage.getTakesList() ||
         (schedule && (schedule.getEndBin() || schedule.getAfter()));
}

static ScheduleKind getKind(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  return schedule ? schedule.getKind() : ScheduleKind::LoadBalance;
}

static bool runsForEmptyBins(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  return schedule && schedule.getEveryBin();
}

//===----------------------------------------------------------------------===//
// Conditions
//===----------------------------------------------------------------------===//

LogicalResult Candidate::checkBins(Refusal &refusal) {
  if (hasSource(consumer) || getEdgesInto(consumer).size() != 1)
    return refuse(refusal, consumer, "it is fed from several places");
  if (producer.getBins() != consumer.getBins())
    return refuse(refusal, consumer, "its bins are of another size");
  if (producer.getTile() || consumer.getTile())
    return refuse(refusal, consumer, "bins are divided into tiles");
  if (consumer.isWholeDomain() && getKind(producer) != ScheduleKind::Serialize)
    return refuse(refusal, producer,
                  "one bin is the whole domain, which several threads share");
  if (runsForEmptyBins(consumer) && head().getTakesList() &&
      !runsForEmptyBins(head()))
    return refuse(refusal, head(),
                  "it runs for empty bins, but stage '" + getCppName(head()) +
                      "' does not");
  return success();
}

LogicalResult Candidate::checkSchedules(Refusal &refusal) {
  for (StageOp stage : {producer, consumer}) {
    ScheduleOp schedule = stage.getSchedule();
    if (schedule && !schedule.getBody().empty())
      return refuse(refusal, schedule,
                    "the schedule of stage '" + getCppName(stage) +
                        "' depends on the bin");
    if (schedule && schedule.getTileSplit())
      return refuse(refusal, schedule,
                    "bins of stage '" + getCppName(stage) +
                        "' are cut into tiles, which several threads take");
  }
  ScheduleKind before = getKind(producer), kind = getKind(consumer);
  // Whichever core has the bin will do.
  bool follows =
      kind == ScheduleKind::LoadBalance && before != ScheduleKind::Serialize;
  if (kind == before || follows)
    return success();
  ScheduleOp schedule = consumer.getSchedule();
  return refuse(refusal, schedule ? schedule.getOperation() : consumer,
                stringifyScheduleKind(kind) + " may choose another core than " +
                    stringifyScheduleKind(before) + " of stage '" +
                    getCppName(producer) + "'");
}

LogicalResult Candidate::checkAssign(Refusal &refusal) {
  for (auto assign : host.getOps<AssignOp>()) {
    if (assign.getStage() != consumer.getSymName())
      continue;
    WalkResult other = assign.walk([&](Operation *op) {
      auto assignment = dyn_cast<AssignmentOpInterface>(op);
      if (!assignment || assignment.keepsBin())
        return WalkResult::advance();
      (void)refuse(refusal, op, "the bin is not known to be the same");
      return WalkResult::interrupt();
    });
    if (other.wasInterrupted())
      return failure();
  }
  return success();
}

LogicalResult Candidate::checkWaits(Refusal &refusal) {
  ScheduleOp schedule = consumer.getSchedule();
  if (!schedule || !schedule.getEndStageAttr())
    return success();
  for (auto name : schedule.getEndStageAttr().getAsRange<FlatSymbolRefAttr>()) {
    auto other = lookupInPipeline<StageOp>(schedule, name);
    KernelOp runs = findKernel(other);
    if (runs && (runs == host || !runs->isBeforeInBlock(host)))
      return refuse(refusal, schedule,
                    "it waits for all of stage '" + getCppName(other) + "'");
  }
  return success();
}

/// What the phases of a kernel do to state, and where.
static llvm::MapVector<Attribute, std::pair<int, Operation *>>
findAccesses(KernelOp kernel) {
  llvm::MapVector<Attribute, std::pair<int, Operation *>> accesses;
  kernel.walk([&](Operation *op) {
    auto [state, access] = getStateAccess(op);
    if (!state)
      return;
    auto &[kinds, at] = accesses[state];
    kinds |= access;
    if (!at || access != StateAccess::reads)
      at = op;
  });
  return accesses;
}

/// Without the kernel break, calls of the two stages are concurrent, if for
/// different bins; and kernels between the two run later than the consumer.
LogicalResult Candidate::checkState(Refusal &refusal) {
  auto mine = findAccesses(kernel);
  for (Operation *at = host; at != kernel; at = at->getNextNode()) {
    auto other = dyn_cast<KernelOp>(at);
    if (!other)
      continue;
    auto theirs = findAccesses(other);
    for (auto [state, access] : mine) {
      auto [kinds, where] = theirs.lookup(state);
      int both = kinds | access.first;
      // Both update pixels of the one bin, one stage after the other.
      bool isLocal = other == host && both == StateAccess::updates;
      if (!kinds || both == StateAccess::reads || isLocal ||
          both == StateAccess::changesAtomically)
        continue;
      return refuse(refusal, where,
                    "it and stage '" + getCppName(getPhaseStage(where)) +
                        "' both use @" +
                        cast<FlatSymbolRefAttr>(state).getValue() +
                        ", which one of them writes");
    }
  }
  return success();
}

LogicalResult Candidate::check(Refusal &refusal) {
  for (StageOp stage : {producer, consumer})
    if (isOnCycle(stage))
      return refuse(refusal, stage,
                    "stage '" + getCppName(stage) + "' is on a cycle");
  return failure(failed(checkBins(refusal)) ||
                 failed(checkSchedules(refusal)) ||
                 failed(checkAssign(refusal)) || failed(checkWaits(refusal)) ||
                 failed(checkState(refusal)));
}

//===----------------------------------------------------------------------===//
// Rewriting
//===----------------------------------------------------------------------===//

void Candidate::fuse() {
  Block *body = host.getBodyBlock();
  OpBuilder builder = OpBuilder::atBlockEnd(body);
  ScheduleOp schedule = consumer.getSchedule();
  LocalBarrierOp::create(
      builder, (schedule ? schedule.getOperation() : consumer)->getLoc(),
      edge.getProducerAttr(), edge.getPortAttr(), edge.getConsumerAttr());
  body->getOperations().splice(body->end(),
                               kernel.getBodyBlock()->getOperations());
  kernel.erase();
}

void FuseKernelsPass::fuseInto(KernelOp host) {
  llvm::SmallDenseSet<Attribute> inside{host.getProcess().getStageAttr()};
  Operation *next = nullptr;
  // In order: where two stages update a pixel, they do so as before.
  for (Operation *op = host->getNextNode(); op; op = next) {
    next = op->getNextNode();
    auto kernel = dyn_cast<KernelOp>(op);
    if (!kernel || !kernel.getProcess())
      continue;
    auto edges = edgesInto.find(kernel.getProcess().getStageAttr());
    if (edges == edgesInto.end())
      continue;
    EdgeOp *edge = llvm::find_if(edges->second, [&](EdgeOp edge) {
      return inside.contains(edge.getProducerAttr());
    });
    if (edge == edges->second.end())
      continue;
    StageOp consumer = getPhaseStage(kernel.getProcess());
    if (!waitsForBin(consumer))
      continue;
    auto producer = lookupInPipeline<StageOp>(*edge, edge->getProducerAttr());
    Candidate candidate{*edge, producer, consumer, host, kernel};
    Refusal refusal;
    if (failed(candidate.check(refusal))) {
      InFlightDiagnostic remark = consumer.emitRemark()
                                  << "stage '" << getCppName(consumer)
                                  << "' does not run bin by bin after stage '"
                                  << getCppName(producer) << "'";
      remark.attachNote(refusal.at->getLoc()) << refusal.why;
      continue;
    }
    consumer.emitRemark() << "stage '" << getCppName(consumer)
                          << "' runs bin by bin after stage '"
                          << getCppName(producer) << "'";
    inside.insert(kernel.getProcess().getStageAttr());
    candidate.fuse();
  }
}

void FuseKernelsPass::runOnOperation() {
  // The checker follows the stages as they are written.
  if (!getOperation().getOps<CheckRecordOp>().empty())
    return;
  edgesInto.clear();
  for (auto edge : getOperation().getOps<EdgeOp>())
    edgesInto[edge.getConsumerAttr()].push_back(edge);
  // Those after a kernel may become part of it.
  Block &body = *getOperation().getBodyBlock();
  for (auto op = body.begin(); op != body.end(); ++op)
    if (auto kernel = dyn_cast<KernelOp>(*op); kernel && kernel.getProcess())
      fuseInto(kernel);
}
