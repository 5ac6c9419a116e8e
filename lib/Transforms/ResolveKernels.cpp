// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-resolve-kernels, for each kernel:
//   1. build the loops: units of work, their cells, the primitives of a cell
//      (or the calls of a process phase that takes a list);
//   2. move the process phase (or, for a source, nothing) into the innermost;
//   3. turn each emission into an append, followed by a copy of the consumer's
//      assign phase;
//   4. turn assignments into placements, and queries into arithmetic;
//   5. do the same for each phase behind a local barrier, where a bin ends.

#include "Piko/Analysis/PhaseGraph.h"
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

/// A process phase and the assign phases that take its ports.
struct Group {
  LocalBarrierOp barrier; // null for the first
  ProcessOp process;
  llvm::DenseMap<int64_t, AssignOp> assigns; // by port
  StageOp stage;
  Value writer;
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
  /// A loop over primitives, or over calls, of a list of one bin.
  Value buildItemLoop(OpBuilder &builder, StageOp of, Value bins, Value begin,
                      Value end);
  void buildLocalBin(OpBuilder &builder, Group &group, Value bin);
  /// Where the phase is that takes the primitives of the stage's bins.
  Location getPhaseLoc(StageOp of);
  /// Moves a group's process phase to where `builder` stands.
  void resolveProcess(OpBuilder &builder, Group &group, const Place &place);
  void resolveEmit(EmitOp emit, Group &group, const Place &place);
  void resolveAssign(OpBuilder &builder, AssignOp assign, Value prim,
                     const Place &place);
  void resolveAssignment(Operation *op, StageOp consumer, OwnerOp owner,
                         IntegerAttr port, const Place &place);

  KernelOp kernel;
  Location loc;
  SmallVector<Group> groups;   // none in a source's kernel
  AssignOp sourceAssign;       // null elsewhere
  StageOp stage;               // whose bins are open
  Operation *binEnd = nullptr; // in front of which what waits for a bin goes
};

} // namespace

KernelResolver::KernelResolver(KernelOp kernel)
    : kernel(kernel), loc(kernel.getLoc()) {
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
  stage = sourceAssign ? getPhaseStage(sourceAssign) : groups.front().stage;
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
  Value writer =
      OpenWriterOp::create(builder, loc, bins, unit, FlatSymbolRefAttr());
  Operation *close = CloseWriterOp::create(builder, loc, writer);
  for (Group &group : groups) {
    group.writer = writer;
    if (!group.barrier)
      continue;
    Location at = group.process.getLoc();
    builder.setInsertionPoint(close);
    group.writer = OpenWriterOp::create(builder, at, bins, unit,
                                        group.process.getStageAttr());
    close = CloseWriterOp::create(builder, at, group.writer);
  }
  builder.setInsertionPoint(close);
  Place place = stage.getTakesList() && !source
                    ? buildCallLoop(builder, bins, unit)
                    : buildCellLoops(builder, bins, unit);
  place.writer = writer;
  auto next = NextOp::create(builder, loc, writer);
  builder.setInsertionPoint(next);
  return place;
}

Location KernelResolver::getPhaseLoc(StageOp of) {
  if (sourceAssign)
    return sourceAssign.getLoc();
  for (Group &group : groups)
    if (group.stage == of)
      return group.process.getLoc();
  return loc;
}

Value KernelResolver::buildItemLoop(OpBuilder &builder, StageOp of, Value bins,
                                    Value begin, Value end) {
  Location at = getPhaseLoc(of);
  Value one = arith::ConstantIndexOp::create(builder, at, 1);
  auto loop = scf::ForOp::create(builder, at, begin, end, one);
  loop->setAttr("piko.lanes", builder.getUnitAttr());
  builder.setInsertionPointToStart(loop.getBody());
  auto type = PrimType::get(builder.getContext(), of.getInputAttr());
  return ItemOp::create(builder, at, type, bins, loop.getInductionVar());
}

Place KernelResolver::buildCellLoops(OpBuilder &builder, Value bins,
                                     Value unit) {
  auto cells = UnitCellsOp::create(builder, loc, bins, unit);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  auto cellLoop =
      scf::ForOp::create(builder, loc, cells.getBegin(), cells.getEnd(), one);
  binEnd = cellLoop.getBody()->getTerminator();
  builder.setInsertionPointToStart(cellLoop.getBody());
  Value cell = cellLoop.getInductionVar();
  Value bin = CellBinOp::create(builder, loc, bins, cell);
  auto range = CellRangeOp::create(builder, loc, bins, unit, cell);
  Value prim =
      buildItemLoop(builder, stage, bins, range.getBegin(), range.getEnd());
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
  Value list =
      ListOp::create(builder, getPhaseLoc(stage), stage.getProcessType(), bins,
                     range.getBegin(), range.getEnd());
  if (groups.size() > 1) {
    // A bin ends with its last batch: the next call is for another one.
    Value last = arith::SubIOp::create(builder, loc, calls.getEnd(), one);
    Value next = arith::AddIOp::create(builder, loc, call, one);
    Value at = arith::MinUIOp::create(builder, loc, next, last);
    Value other = CallBinOp::create(builder, loc, bins, at);
    auto compare = [&](arith::CmpIPredicate predicate, Value a, Value b) {
      return arith::CmpIOp::create(builder, loc, predicate, a, b).getResult();
    };
    Value ends = arith::OrIOp::create(
        builder, loc, compare(arith::CmpIPredicate::eq, call, last),
        compare(arith::CmpIPredicate::ne, other, bin));
    auto choice = scf::IfOp::create(builder, loc, ends,
                                    /*withElseRegion=*/false);
    binEnd = choice.thenBlock()->getTerminator();
    builder.setInsertionPoint(choice);
  }
  return {Value(), bin, list};
}

void KernelResolver::buildLocalBin(OpBuilder &builder, Group &group,
                                   Value bin) {
  Location at = group.barrier.getLoc();
  Value source;
  for (Group &other : groups)
    if (other.process.getStageAttr() == group.barrier.getProducerAttr())
      source = other.writer;
  auto local =
      LocalBinOp::create(builder, at, group.process.getStageAttr(), source,
                         group.barrier.getPortAttr(), group.writer);
  auto type = BinsType::get(builder.getContext(), group.stage.getInputAttr());
  Block &body = local.getBody().emplaceBlock();
  Value bins = body.addArgument(type, at);
  builder.setInsertionPointToEnd(&body);
  Value zero = arith::ConstantIndexOp::create(builder, at, 0);
  auto next = NextOp::create(builder, at, group.writer);
  builder.setInsertionPoint(next);
  Value input;
  if (group.stage.getTakesList()) {
    auto calls = UnitCellsOp::create(builder, at, bins, zero);
    Value one = arith::ConstantIndexOp::create(builder, at, 1);
    auto loop =
        scf::ForOp::create(builder, at, calls.getBegin(), calls.getEnd(), one);
    builder.setInsertionPointToStart(loop.getBody());
    auto range = CallRangeOp::create(builder, at, bins, loop.getInductionVar());
    input = ListOp::create(builder, group.process.getLoc(),
                           group.stage.getProcessType(), bins, range.getBegin(),
                           range.getEnd());
  } else {
    auto range = CellRangeOp::create(builder, at, bins, zero, zero);
    input = buildItemLoop(builder, group.stage, bins, range.getBegin(),
                          range.getEnd());
  }
  resolveProcess(builder, group, {group.writer, bin, input});
  builder.setInsertionPointAfter(local);
}

void KernelResolver::resolveProcess(OpBuilder &builder, Group &group,
                                    const Place &place) {
  SmallVector<EmitOp> emits;
  group.process.walk([&](EmitOp emit) { emits.push_back(emit); });
  // Before emissions bring in the assign phases of other stages, whose queries
  // are about other bins.
  expandQueries(group.process, group.stage, place.bin);
  IRRewriter rewriter(builder);
  Block &body = group.process.getBody().front();
  body.getTerminator()->erase();
  rewriter.inlineBlockBefore(&body, builder.getInsertionBlock(),
                             builder.getInsertionPoint(), place.input);
  for (EmitOp emit : emits)
    resolveEmit(emit, group, place);
}

void KernelResolver::run() {
  OpBuilder builder = OpBuilder::atBlockEnd(kernel.getBodyBlock());
  Place place = buildLoops(builder);
  if (sourceAssign)
    resolveAssign(builder, sourceAssign, place.input, place);
  for (Group &group : groups) {
    if (!group.barrier) {
      resolveProcess(builder, group, place);
      if (binEnd)
        builder.setInsertionPoint(binEnd);
      continue;
    }
    buildLocalBin(builder, group, place.bin);
    for (auto edge : getPipeline(kernel).getOps<EdgeOp>())
      if (edge.getConsumerAttr() == group.process.getStageAttr())
        edge.setLocal(true);
  }
  for (Operation &op : llvm::make_early_inc_range(*kernel.getBodyBlock()))
    if (isa<ProcessOp, AssignOp, LocalBarrierOp>(op))
      op.erase();
}

void KernelResolver::resolveEmit(EmitOp emit, Group &group,
                                 const Place &place) {
  OpBuilder builder(emit);
  auto record =
      cast<FlatSymbolRefAttr>(group.stage.getOutputs()[emit.getPort()]);
  Value stored = AppendOp::create(
      builder, emit.getLoc(), PrimType::get(builder.getContext(), record),
      place.writer, emit.getPortAttr(), emit.getValues());
  if (AssignOp assign = group.assigns.lookup(emit.getPort()))
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
    // Where a bin's end counts, one thread runs it.
    bool isLocal =
        !op->getParentOfType<KernelOp>().getOps<LocalBarrierOp>().empty();
    stage.setSplit(!serial && !ordered && !isLocal);
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
