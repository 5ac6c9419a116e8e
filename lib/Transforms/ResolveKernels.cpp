// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-resolve-kernels, for each kernel:
//   1. build the loops: units of work, their cells, the primitives of a cell
//      (or the calls of a process phase that takes a list);
//   2. move the process phase (or, for a source, nothing) into the innermost;
//   3. turn each emission into an append, followed by a copy of the consumer's
//      assign phase;
//   4. turn assignments into placements, and queries into arithmetic.

#include "PhaseGraph.h"
#include "Resolve.h"

#include "Piko/Transforms/BinArithmetic.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/PatternMatch.h"

namespace piko {
#define GEN_PASS_DEF_RESOLVEKERNELS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct ResolveKernelsPass : piko::impl::ResolveKernelsBase<ResolveKernelsPass> {
  void runOnOperation() override;
};

/// Where the statements of a phase find themselves in the loops.
struct Place {
  Value writer, bin;
  Value input; ///< the primitive, or the list
};

class KernelResolver {
public:
  explicit KernelResolver(KernelOp kernel);
  void run();

private:
  Place buildLoops(OpBuilder &builder);
  /// The loops inside that over units, which leave `builder` in the innermost,
  /// and the place there but for its writer.
  Place buildCellLoops(OpBuilder &builder, Value bins, Value unit);
  Place buildCallLoop(OpBuilder &builder, Value bins, Value unit);
  void resolveEmit(EmitOp emit, const Place &place);
  void resolveAssign(OpBuilder &builder, AssignOp assign, Value prim,
                     const Place &place);
  void resolveAssignment(Operation *op, StageOp consumer, OwnerOp owner,
                         IntegerAttr port, const Place &place);

  KernelOp kernel;
  Location loc;
  ProcessOp process;                         // null in a source's kernel
  AssignOp sourceAssign;                     // null elsewhere
  llvm::DenseMap<int64_t, AssignOp> assigns; // by port
  StageOp stage;
};

} // namespace

KernelResolver::KernelResolver(KernelOp kernel)
    : kernel(kernel), loc(kernel.getLoc()), process(kernel.getProcess()) {
  for (auto assign : kernel.getOps<AssignOp>()) {
    if (assign.getPort())
      assigns[*assign.getPort()] = assign;
    else
      sourceAssign = assign;
  }
  stage = getPhaseStage(process ? process.getOperation()
                                : sourceAssign.getOperation());
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

Place KernelResolver::buildLoops(OpBuilder &builder) {
  IntegerAttr source = sourceAssign ? sourceAssign.getSourceAttr() : nullptr;
  auto type = BinsType::get(builder.getContext(), stage.getInputAttr());
  Value bins = OpenBinsOp::create(
      builder, loc, type, FlatSymbolRefAttr::get(stage.getSymNameAttr()),
      source);
  Value units = UnitCountOp::create(builder, loc, bins);
  auto forall = scf::ForallOp::create(
      builder, loc, ArrayRef<OpFoldResult>{units}, ValueRange(), std::nullopt);
  ScheduleOp schedule = stage.getSchedule();
  forall->setAttr("piko.schedule",
                  builder.getStringAttr(stringifyScheduleKind(
                      schedule && !source ? schedule.getKind()
                                          : ScheduleKind::LoadBalance)));
  CloseBinsOp::create(builder, loc, bins);

  Value unit = forall.getInductionVar(0);
  builder.setInsertionPoint(forall.getTerminator());
  Value writer = OpenWriterOp::create(builder, loc, bins, unit);
  auto close = CloseWriterOp::create(builder, loc, writer);
  builder.setInsertionPoint(close);
  Place place = process && stage.getTakesList()
                    ? buildCallLoop(builder, bins, unit)
                    : buildCellLoops(builder, bins, unit);
  place.writer = writer;
  auto next = NextOp::create(builder, loc, writer);
  builder.setInsertionPoint(next);
  return place;
}

Place KernelResolver::buildCellLoops(OpBuilder &builder, Value bins,
                                     Value unit) {
  auto cells = UnitCellsOp::create(builder, loc, bins, unit);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  auto cellLoop =
      scf::ForOp::create(builder, loc, cells.getBegin(), cells.getEnd(), one);
  builder.setInsertionPointToStart(cellLoop.getBody());
  Value cell = cellLoop.getInductionVar();
  Value bin = CellBinOp::create(builder, loc, bins, cell);
  auto range = CellRangeOp::create(builder, loc, bins, unit, cell);
  auto itemLoop =
      scf::ForOp::create(builder, loc, range.getBegin(), range.getEnd(), one);
  itemLoop->setAttr("piko.lanes", builder.getUnitAttr());
  builder.setInsertionPointToStart(itemLoop.getBody());
  auto primType = PrimType::get(builder.getContext(), stage.getInputAttr());
  Value prim =
      ItemOp::create(builder, loc, primType, bins, itemLoop.getInductionVar());
  return {Value(), bin, prim};
}

Place KernelResolver::buildCallLoop(OpBuilder &builder, Value bins,
                                    Value unit) {
  auto calls = UnitCellsOp::create(builder, loc, bins, unit);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  auto loop =
      scf::ForOp::create(builder, loc, calls.getBegin(), calls.getEnd(), one);
  builder.setInsertionPointToStart(loop.getBody());
  Value call = loop.getInductionVar();
  Value bin = CallBinOp::create(builder, loc, bins, call);
  auto range = CallRangeOp::create(builder, loc, bins, call);
  Value list = ListOp::create(builder, loc, stage.getProcessType(), bins,
                              range.getBegin(), range.getEnd());
  return {Value(), bin, list};
}

void KernelResolver::run() {
  OpBuilder builder = OpBuilder::atBlockEnd(kernel.getBodyBlock());
  Place place = buildLoops(builder);
  if (sourceAssign) {
    resolveAssign(builder, sourceAssign, place.input, place);
  } else {
    IRRewriter rewriter(builder);
    Block &body = process.getBody().front();
    body.getTerminator()->erase();
    rewriter.inlineBlockBefore(&body, builder.getInsertionBlock(),
                               builder.getInsertionPoint(), place.input);
    SmallVector<EmitOp> emits;
    kernel.walk([&](EmitOp emit) { emits.push_back(emit); });
    // Before emissions bring in the assign phases of other stages, whose
    // queries are about other bins.
    for (auto loop : kernel.getOps<scf::ForallOp>())
      expandQueries(loop, stage, place.bin);
    for (EmitOp emit : emits)
      resolveEmit(emit, place);
  }
  for (auto assign : llvm::to_vector(kernel.getOps<AssignOp>()))
    assign.erase();
  if (process)
    process.erase();
}

void KernelResolver::resolveEmit(EmitOp emit, const Place &place) {
  OpBuilder builder(emit);
  auto record = cast<FlatSymbolRefAttr>(stage.getOutputs()[emit.getPort()]);
  Value stored = AppendOp::create(
      builder, emit.getLoc(), PrimType::get(builder.getContext(), record),
      place.writer, emit.getPortAttr(), emit.getValues());
  if (AssignOp assign = assigns.lookup(emit.getPort()))
    resolveAssign(builder, assign, stored, place);
  emit.erase();
}

void KernelResolver::resolveAssign(OpBuilder &builder, AssignOp assign,
                                   Value prim, const Place &place) {
  StageOp consumer = getPhaseStage(assign);
  IRMapping mapping;
  mapping.map(assign.getBody().getArgument(0), prim);
  SmallVector<Operation *> copies;
  for (Operation &op : assign.getBody().front().without_terminator())
    copies.push_back(builder.clone(op, mapping));
  OwnerOp owner;
  SmallVector<Operation *> assignments;
  for (Operation *copy : copies)
    copy->walk([&](Operation *op) {
      noteOrigin(op, consumer, /*inAssign=*/true);
      if (auto found = dyn_cast<OwnerOp>(op))
        owner = found;
      else if (isa<AssignToOp, AssignAllOp, AssignPreviousOp, AssignBoxOp>(op))
        assignments.push_back(op);
    });
  for (Operation *op : assignments)
    resolveAssignment(op, consumer, owner, assign.getPortAttr(), place);
  if (owner) {
    llvm::erase(copies, owner.getOperation());
    owner.erase();
  }
  for (Operation *copy : copies)
    if (!llvm::is_contained(assignments, copy))
      expandQueries(copy, consumer, /*bin=*/Value());
}

void KernelResolver::resolveAssignment(Operation *op, StageOp consumer,
                                       OwnerOp owner, IntegerAttr port,
                                       const Place &place) {
  OpBuilder builder(op);
  BinArithmetic bins(builder, op->getLoc(), consumer);
  auto name = FlatSymbolRefAttr::get(consumer.getSymNameAttr());
  auto put = [&](OpBuilder &at, Value bin) {
    Value tile;
    if (owner)
      tile = BinArithmetic(at, op->getLoc(), consumer)
                 .tileAt(bin, owner.getCoordinates());
    PlaceOp::create(at, op->getLoc(), place.writer, port, name, bin, tile);
  };
  if (auto to = dyn_cast<AssignToOp>(op)) {
    put(builder, to.getBin());
  } else if (isa<AssignPreviousOp>(op)) {
    put(builder, place.bin);
  } else if (auto box = dyn_cast<AssignBoxOp>(op)) {
    bins.forEachBinIn(box.getLo(), box.getHi(), put);
  } else {
    auto loop = scf::ForOp::create(builder, op->getLoc(), bins.constant(0),
                                   bins.binCount(), bins.constant(1));
    builder.setInsertionPointToStart(loop.getBody());
    put(builder, loop.getInductionVar());
  }
  op->erase();
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
    bool ordered = op->walk([](UpdateOp) {
                       return WalkResult::interrupt();
                     }).wasInterrupted();
    stage.setOrdered(ordered);
    stage.setWrites(op->walk([](Operation *inner) {
                        return isa<UpdateOp, StoreOp, AtomicOp>(inner)
                                   ? WalkResult::interrupt()
                                   : WalkResult::advance();
                      }).wasInterrupted());
    stage.setSplit(!serial && !ordered);
  });
}

void ResolveKernelsPass::runOnOperation() {
  noteStages(getOperation());
  for (auto stage : getOperation().getOps<StageOp>())
    if (ScheduleOp schedule = stage.getSchedule();
        schedule && !schedule.getBody().empty())
      resolveSchedule(schedule);
  for (auto kernel : getOperation().getOps<KernelOp>())
    if (llvm::any_of(*kernel.getBodyBlock(), [](Operation &op) {
          return isa<ProcessOp, AssignOp>(op);
        }))
      KernelResolver(kernel).run();
}
