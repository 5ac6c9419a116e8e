// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-form-work, for each kernel:
//   1. make a piko.bins of the stage, with the process phase in it as work on
//   the
//      primitives of a bin or on its list; the same for each phase after a
//      local barrier; or work on a source;
//   2. put a copy of the consumer's assign phase after each emission;
//   3. turn assignments into placements, and queries into arithmetic.

#include "Machine/FormWork.h"

#include "Piko/Analysis/PhaseGraph.h"
#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/PatternMatch.h"

namespace piko {
#define GEN_PASS_DEF_FORMWORK
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct FormWorkPass : piko::impl::FormWorkBase<FormWorkPass> {
  void runOnOperation() override;
};

/// A process phase and the assign phases that take its ports.
struct Group {
  LocalBarrierOp barrier; // null for the first
  ProcessOp process;
  llvm::DenseMap<int64_t, AssignOp> assigns; // by port
  StageOp stage;
};

class WorkFormer {
public:
  explicit WorkFormer(KernelOp kernel);
  void run();

private:
  void formSource();
  void formBins();
  /// Makes work of a group's process phase where `builder` stands.
  void formWork(OpBuilder &builder, Group &group);
  void convertEmit(EmissionOpInterface emit, Group &group);
  void copyAssign(OpBuilder &builder, AssignOp assign, Value prim);
  void convertAssignment(AssignmentOpInterface op, StageOp consumer,
                         OwnerOp owner, Value prim);

  KernelOp kernel;
  Location loc;
  SmallVector<Group> groups; // none in a source's kernel
  AssignOp sourceAssign;     // null elsewhere
  Value bin;                 // null in a source's kernel
};

} // namespace

WorkFormer::WorkFormer(KernelOp kernel) : kernel(kernel), loc(kernel.getLoc()) {
  for (Operation &op : *kernel.getBodyBlock()) {
    if (auto process = dyn_cast<ProcessOp>(op)) {
      Group &group = groups.emplace_back();
      group.barrier = dyn_cast_or_null<LocalBarrierOp>(op.getPrevNode());
      group.process = process;
      group.stage = getPhaseStage(process);
    }
    if (auto assign = dyn_cast<AssignOp>(op)) {
      if (assign.getPort())
        groups.back().assigns[*assign.getPort()] = assign;
      else
        sourceAssign = assign;
    }
  }
}

void piko::expandQueries(Operation *root, StageOp stage, Value bin) {
  root->walk([&](Operation *op) {
    OpBuilder builder(op);
    BinArithmetic bins(builder, op->getLoc(), stage);
    Value result;
    if (isa<BinOp>(op) && bin)
      result = bin;
    else if (auto at = dyn_cast<BinAtOp>(op))
      result = bins.binAt(at.getCoordinates());
    else if (auto lo = dyn_cast<BinLoOp>(op))
      result = bins.lo(lo.getBin(), lo.getDim());
    else if (auto hi = dyn_cast<BinHiOp>(op))
      result = bins.hi(hi.getBin(), hi.getDim());
    else if (auto update = dyn_cast<UpdateOp>(op); update && bin)
      update.getBinMutable().assign(bin);
    if (!result)
      return;
    op->getResult(0).replaceAllUsesWith(result);
    op->erase();
  });
}

void WorkFormer::run() {
  if (sourceAssign)
    formSource();
  else
    formBins();
  for (Operation &op : llvm::make_early_inc_range(*kernel.getBodyBlock()))
    if (isa<ProcessOp, AssignOp, LocalBarrierOp>(op))
      op.erase();
}

void WorkFormer::formSource() {
  OpBuilder builder = OpBuilder::atBlockEnd(kernel.getBodyBlock());
  Location at = sourceAssign.getLoc();
  StageOp stage = getPhaseStage(sourceAssign);
  auto items = ItemsOp::create(
      builder, at, FlatSymbolRefAttr::get(stage.getSymNameAttr()),
      sourceAssign.getSourceAttr(), /*producer=*/nullptr, /*port=*/nullptr,
      /*lanes=*/nullptr);
  Block &body = items.getBody().emplaceBlock();
  Value prim = body.addArgument(
      PrimType::get(builder.getContext(), stage.getInputAttr()), at);
  builder.setInsertionPointToEnd(&body);
  copyAssign(builder, sourceAssign, prim);
}

void WorkFormer::formBins() {
  OpBuilder builder = OpBuilder::atBlockEnd(kernel.getBodyBlock());
  auto bins =
      BinsOp::create(builder, loc, groups.front().process.getStageAttr());
  Block &body = bins.getBody().emplaceBlock();
  bin = body.addArgument(builder.getIndexType(), loc);
  builder.setInsertionPointToEnd(&body);
  for (Group &group : groups)
    formWork(builder, group);
}

void WorkFormer::formWork(OpBuilder &builder, Group &group) {
  Location at = group.process.getLoc();
  FlatSymbolRefAttr stage = group.process.getStageAttr(), producer;
  IntegerAttr port;
  if (group.barrier) {
    producer = group.barrier.getProducerAttr();
    port = group.barrier.getPortAttr();
  }
  Operation *work;
  if (group.stage.getTakesList())
    work = ListsOp::create(builder, at, stage, producer, port,
                           /*lanes=*/nullptr);
  else
    work = ItemsOp::create(builder, at, stage, /*source=*/nullptr, producer,
                           port, /*lanes=*/nullptr);

  SmallVector<EmissionOpInterface> emits;
  group.process.walk([&](EmissionOpInterface emit) { emits.push_back(emit); });
  // Before emissions bring in the assign phases of other stages, whose queries
  // are about other bins.
  expandQueries(group.process, group.stage, bin);
  group.process.getBody().front().getTerminator()->erase();
  work->getRegion(0).takeBody(group.process.getBody());
  group.process.getBody().emplaceBlock(); // until it is erased
  for (EmissionOpInterface emit : emits)
    convertEmit(emit, group);
}

void WorkFormer::convertEmit(EmissionOpInterface emit, Group &group) {
  AssignOp assign = group.assigns.lookup(emit.getPort());
  if (!assign) {
    asEmit(emit);
    return;
  }
  OpBuilder builder(emit);
  auto record =
      cast<FlatSymbolRefAttr>(group.stage.getOutputs()[emit.getPort()]);
  auto emitted = EmitOp::create(builder, emit.getLoc(),
                                PrimType::get(builder.getContext(), record),
                                emit.getPort(), emit.getNumbers());
  copyAssign(builder, assign, emitted.getPrim());
  emit.erase();
}

void WorkFormer::copyAssign(OpBuilder &builder, AssignOp assign, Value prim) {
  StageOp consumer = getPhaseStage(assign);
  IRMapping mapping;
  mapping.map(assign.getBody().getArgument(0), prim);
  SmallVector<Operation *> copies;
  for (Operation &op : assign.getBody().front().without_terminator())
    copies.push_back(builder.clone(op, mapping));
  OwnerOp owner;
  SmallVector<AssignmentOpInterface> assignments;
  for (Operation *copy : copies)
    copy->walk([&](Operation *op) {
      noteOrigin(op, consumer, /*inAssign=*/true);
      if (auto found = dyn_cast<OwnerOp>(op))
        owner = found;
      else if (auto assignment = dyn_cast<AssignmentOpInterface>(op))
        assignments.push_back(assignment);
    });
  for (AssignmentOpInterface op : assignments) {
    llvm::erase(copies, op.getOperation());
    convertAssignment(op, consumer, owner, prim);
  }
  if (owner) {
    llvm::erase(copies, owner.getOperation());
    owner.erase();
  }
  for (Operation *copy : copies)
    expandQueries(copy, consumer, /*bin=*/Value());
}

void WorkFormer::convertAssignment(AssignmentOpInterface op, StageOp consumer,
                                   OwnerOp owner, Value prim) {
  OpBuilder builder(op);
  Location at = op.getLoc();
  auto name = FlatSymbolRefAttr::get(consumer.getSymNameAttr());
  op.buildBins(builder, consumer, bin, [&](OpBuilder &inside, Value to) {
    Value tile;
    if (owner)
      tile = BinArithmetic(inside, at, consumer)
                 .tileAt(to, owner.getCoordinates());
    PlaceOp::create(inside, at, prim, name, to, tile);
  });
  op->erase();
}

/// Whether a phase has an access of one of these kinds: bits.
static bool hasAccess(Operation *phase, int kinds) {
  return phase
      ->walk([&](StateAccessOpInterface access) {
        return access.getAccessKinds() & kinds ? WalkResult::interrupt()
                                               : WalkResult::advance();
      })
      .wasInterrupted();
}

/// Notes at the stages what cannot be seen in kernels any more: whether the
/// order of a bin's primitives shows in the state, whether threads may share
/// them, whether assign phases place them, and whether state is written.
static void noteStages(PipelineOp pipeline) {
  pipeline.walk([](Operation *op) {
    if (!isa<ProcessOp, AssignOp>(op))
      return;
    StageOp stage = getPhaseStage(op);
    if (isa<AssignOp>(op)) {
      stage.setPlaced(true);
      return;
    }
    ScheduleOp schedule = stage.getSchedule();
    bool serial = schedule && schedule.getKind() == ScheduleKind::Serialize;
    bool ordered = hasAccess(op, StateAccess::updates);
    stage.setOrdered(ordered);
    stage.setWrites(hasAccess(op, ~StateAccess::reads));
    // Where a bin's end counts, one thread runs it.
    bool isLocal =
        !op->getParentOfType<KernelOp>().getOps<LocalBarrierOp>().empty();
    stage.setSplit(!serial && !ordered && !isLocal);
  });
}

/// Whether all phases that give work are in kernels.
static LogicalResult verifyLevel(PipelineOp pipeline) {
  for (auto stage : pipeline.getOps<StageOp>())
    for (Operation &phase : *stage.getBodyBlock())
      if (isa<ProcessOp, AssignOp>(phase))
        return phase.emitError("expected a phase in a kernel, as "
                               "piko-form-kernels puts it, but got it in a "
                               "stage");
  return success();
}

void FormWorkPass::runOnOperation() {
  if (failed(verifyLevel(getOperation())))
    return signalPassFailure();
  noteStages(getOperation());
  for (auto kernel : getOperation().getOps<KernelOp>())
    for (auto local : kernel.getOps<LocalBarrierOp>())
      for (auto edge : getOperation().getOps<EdgeOp>())
        if (edge.getConsumerAttr() == local.getConsumerAttr())
          edge.setLocal(true);
  for (auto stage : getOperation().getOps<StageOp>())
    if (ScheduleOp schedule = stage.getSchedule();
        schedule && !schedule.getBody().empty())
      formScheduleKernel(schedule);
  for (auto kernel : getOperation().getOps<KernelOp>())
    if (llvm::any_of(*kernel.getBodyBlock(), [](Operation &op) {
          return isa<ProcessOp, AssignOp>(op);
        }))
      WorkFormer(kernel).run();
}
