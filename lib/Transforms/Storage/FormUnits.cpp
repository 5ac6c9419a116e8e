// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-form-units, for each kernel:
//   1. build the loops over units of work and their buckets, or the calls of a
//      process phase that takes lists;
//   2. move work on a bin into the innermost, one after another;
//   3. turn emissions and placements into what goes to the unit's writers.

#include "Piko/Transforms/Storage/UnitFormer.h"

#include "Piko/Analysis/PhaseGraph.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/PatternMatch.h"

namespace piko {
#define GEN_PASS_DEF_FORMUNITS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct FormUnitsPass : piko::impl::FormUnitsBase<FormUnitsPass> {
  void runOnOperation() override;
};

} // namespace

/// The stage of bins, or of work.
static FlatSymbolRefAttr getStageName(Operation *op) {
  if (auto bins = dyn_cast<BinsOp>(op))
    return bins.getStageAttr();
  return cast<WorkOpInterface>(op).getStageAttr();
}

/// What a stage's schedule makes of the loop over its units. Without one, or if
/// it is resolved, no scheduler is asked.
static UnitLoop chooseLoop(ScheduleOp schedule) {
  if (!schedule)
    return UnitLoop::Shared;
  if (!schedule.getResolved())
    return UnitLoop::Asked;
  switch (schedule.getKind()) {
  case ScheduleKind::Serialize:
    return UnitLoop::Serial;
  case ScheduleKind::DirectMap:
    return UnitLoop::Mapped;
  case ScheduleKind::LoadBalance:
  case ScheduleKind::All:
    return UnitLoop::Shared;
  }
  llvm_unreachable("not a schedule");
}

void UnitFormer::createUnits(StageOp stage, IntegerAttr source) {
  auto type = BinsType::get(rewriter.getContext(), stage.getInputAttr());
  bins = OpenBinsOp::create(rewriter, loc, type, getStageName(work), source);
  Value count = UnitCountOp::create(rewriter, loc, bins);
  auto forall = scf::ForallOp::create(
      rewriter, loc, ArrayRef<OpFoldResult>{count}, ValueRange(), std::nullopt);
  UnitLoop kind = source ? UnitLoop::Shared : chooseLoop(stage.getSchedule());
  forall->setAttr(marks::units, UnitLoopAttr::get(rewriter.getContext(), kind));
  CloseBinsOp::create(rewriter, loc, bins);
  unit = forall.getInductionVar(0);
  unitEnd = forall.getTerminator();
}

Value UnitFormer::createWriter(Location at, FlatSymbolRefAttr other) {
  rewriter.setInsertionPoint(unitEnd);
  Value writer = OpenWriterOp::create(rewriter, at, bins, unit, other);
  unitEnd = CloseWriterOp::create(rewriter, at, writer);
  return writer;
}

/// One for each stage whose work the kernel holds, closed in reverse.
void UnitFormer::createWriters() {
  writers[getStageName(work)] = createWriter(loc, FlatSymbolRefAttr());
  if (auto over = dyn_cast<BinsOp>(work))
    for (auto piece : over.getOps<WorkOpInterface>())
      if (piece.getProducerAttr())
        writers[piece.getStageAttr()] =
            createWriter(piece.getLoc(), piece.getStageAttr());
  rewriter.setInsertionPoint(unitEnd);
}

void UnitFormer::run() {
  auto stage = lookupInPipeline<StageOp>(work, getStageName(work));
  auto items = dyn_cast<ItemsOp>(work);
  createUnits(stage, items ? items.getSourceAttr() : nullptr);
  createWriters();
  if (items)
    convertSource(items);
  else
    convertBins(cast<BinsOp>(work));
}

scf::ForOp UnitFormer::createUnitLoop() {
  auto buckets = UnitBucketsOp::create(rewriter, loc, bins, unit);
  unitsEnd = buckets.getEnd();
  return scf::ForOp::create(rewriter, loc, buckets.getBegin(), buckets.getEnd(),
                            constant(1));
}

void UnitFormer::convertSource(ItemsOp items) {
  scf::ForOp loop = createUnitLoop();
  items->moveBefore(loop.getBody()->getTerminator());
  rewriter.setInsertionPoint(items);
  auto range =
      BucketRangeOp::create(rewriter, loc, bins, unit, loop.getInductionVar());
  convertItems(items, bins, range.getBegin(), range.getEnd(),
               writers.lookup(items.getStageAttr()));
}

/// Whether work on what is emitted in a bin runs for bins in which nothing is.
static bool visitsEmptyBins(ArrayRef<WorkOpInterface> locals) {
  return llvm::any_of(locals, [](WorkOpInterface local) {
    auto stage = lookupInPipeline<StageOp>(local, local.getStageAttr());
    ScheduleOp schedule = stage.getSchedule();
    return schedule && schedule.getEveryBin();
  });
}

void UnitFormer::convertBins(BinsOp over) {
  scf::ForOp loop = createUnitLoop();
  Operation *end = loop.getBody()->getTerminator();
  rewriter.setInsertionPointToStart(loop.getBody());
  Value at = loop.getInductionVar(),
        writer = writers.lookup(getStageName(work));
  bool hasTiles = !over.getBodyBlock()->getOps<TileOp>().empty();
  SmallVector<WorkOpInterface> locals(over.getOps<WorkOpInterface>());
  WorkOpInterface first = locals.front();
  locals.erase(locals.begin());
  bool takesList = first.takesList();
  Value bin = takesList
                  ? CallBinOp::create(rewriter, loc, bins, at).getResult()
                  : BucketBinOp::create(rewriter, loc, bins, at).getResult();
  Block *after = loop.getBody();
  rewriter.inlineBlockBefore(over.getBodyBlock(), end, bin);
  rewriter.eraseOp(over);
  if (takesList && !locals.empty()) {
    rewriter.setInsertionPointAfter(first);
    Operation *next = first->getNextNode();
    after = createBinEnd(at, bin);
    after->getOperations().splice(
        std::prev(after->end()), loop.getBody()->getOperations(),
        next->getIterator(), std::prev(loop.getBody()->end()));
  }
  rewriter.setInsertionPoint(first);
  if (takesList) {
    convertList(cast<ListsOp>(*first), bins, at, writer);
  } else {
    auto range = BucketRangeOp::create(rewriter, loc, bins, unit, at);
    if (hasTiles && !visitsEmptyBins(locals))
      passOverEmptyBins(range, loop);
    convertItems(cast<ItemsOp>(*first), bins, range.getBegin(), range.getEnd(),
                 writer);
  }
  for (WorkOpInterface local : locals)
    convertLocal(local);
}

/// Puts what a bin runs under a test of whether there is something in it: a
/// tile would be filled and written for nothing.
void UnitFormer::passOverEmptyBins(BucketRangeOp range, scf::ForOp loop) {
  Block *body = loop.getBody();
  range->moveBefore(body, std::next(body->begin())); // after its bin
  rewriter.setInsertionPointAfter(range);
  Value isFilled =
      arith::CmpIOp::create(rewriter, loc, arith::CmpIPredicate::ne,
                            range.getBegin(), range.getEnd());
  auto choice = scf::IfOp::create(rewriter, loc, isFilled, /*withElse=*/false);
  Block *rest = choice.thenBlock();
  rest->getOperations().splice(rest->begin(), body->getOperations(),
                               std::next(choice->getIterator()),
                               body->getTerminator()->getIterator());
  rewriter.setInsertionPointToStart(rest);
}

/// A bin ends with its last batch: the next call is for another one.
Block *UnitFormer::createBinEnd(Value call, Value bin) {
  Value one = constant(1);
  Value last = arith::SubIOp::create(rewriter, loc, unitsEnd, one);
  Value next = arith::AddIOp::create(rewriter, loc, call, one);
  Value at = arith::MinUIOp::create(rewriter, loc, next, last);
  Value other = CallBinOp::create(rewriter, loc, bins, at);
  auto compare = [&](arith::CmpIPredicate predicate, Value a, Value b) {
    return arith::CmpIOp::create(rewriter, loc, predicate, a, b).getResult();
  };
  Value ends = arith::OrIOp::create(
      rewriter, loc, compare(arith::CmpIPredicate::eq, call, last),
      compare(arith::CmpIPredicate::ne, other, bin));
  return scf::IfOp::create(rewriter, loc, ends, /*withElseRegion=*/false)
      .thenBlock();
}

void UnitFormer::convertItems(ItemsOp items, Value from, Value begin, Value end,
                              Value writer) {
  Location at = items.getLoc();
  convertEmissions(items, writer);
  if (items.getSource())
    convertPlaces(items.getPrim(), writer, /*port=*/nullptr);
  rewriter.setInsertionPoint(items);
  Value one = arith::ConstantIndexOp::create(rewriter, at, 1);
  auto loop = scf::ForOp::create(rewriter, at, begin, end, one);
  loop->setAttrs(items->getDiscardableAttrDictionary());
  loop->setAttr(marks::lanes, rewriter.getUnitAttr());
  if (std::optional<LaneMapping> lanes = items.getLanes())
    loop->setAttr(marks::mapping,
                  LaneMappingAttr::get(rewriter.getContext(), *lanes));
  rewriter.setInsertionPointToStart(loop.getBody());
  Value prim = ItemOp::create(rewriter, at, items.getPrim().getType(), from,
                              loop.getInductionVar());
  Operation *terminator = loop.getBody()->getTerminator();
  for (Operation *user : llvm::make_early_inc_range(items.getPrim().getUsers()))
    if (isa<PositionOp>(user))
      rewriter.replaceOp(user, loop.getInductionVar());
  rewriter.inlineBlockBefore(items.getBodyBlock(), terminator, prim);
  rewriter.setInsertionPoint(terminator);
  if (!items.getProducer())
    NextOp::create(rewriter, loc, writer);
  rewriter.eraseOp(items);
}

void UnitFormer::convertList(ListsOp lists, Value from, Value call,
                             Value writer) {
  convertEmissions(lists, writer);
  rewriter.setInsertionPoint(lists);
  auto range = CallRangeOp::create(rewriter, loc, from, call);
  Value list = ListOp::create(rewriter, lists.getLoc(),
                              cast<ListType>(lists.getList().getType()), from,
                              range.getBegin(), range.getEnd());
  rewriter.inlineBlockBefore(lists.getBodyBlock(), lists, list);
  if (!lists.getProducer())
    NextOp::create(rewriter, loc, writer);
  rewriter.eraseOp(lists);
}

void UnitFormer::convertLocal(WorkOpInterface local) {
  Location at = local.getLoc();
  FlatSymbolRefAttr name = local.getStageAttr();
  auto stage = lookupInPipeline<StageOp>(local, name);
  Value writer = writers.lookup(name);
  rewriter.setInsertionPoint(local);
  auto around = LocalBinOp::create(rewriter, at, name,
                                   writers.lookup(local.getProducerAttr()),
                                   local.getPortAttr(), writer);
  Block &body = around.getBody().emplaceBlock();
  Value from = body.addArgument(
      BinsType::get(rewriter.getContext(), stage.getInputAttr()), at);
  rewriter.setInsertionPointToEnd(&body);
  Value zero = arith::ConstantIndexOp::create(rewriter, at, 0);
  auto next = NextOp::create(rewriter, at, writer);
  rewriter.setInsertionPoint(next);
  if (auto lists = dyn_cast<ListsOp>(*local)) {
    auto calls = UnitBucketsOp::create(rewriter, at, from, zero);
    Value one = arith::ConstantIndexOp::create(rewriter, at, 1);
    auto loop =
        scf::ForOp::create(rewriter, at, calls.getBegin(), calls.getEnd(), one);
    lists->moveBefore(loop.getBody()->getTerminator());
    convertList(lists, from, loop.getInductionVar(), writer);
    return;
  }
  auto range = BucketRangeOp::create(rewriter, at, from, zero, zero);
  local->moveBefore(next);
  if (auto again = local->removeDiscardableAttr(marks::again)) {
    around->setDiscardableAttr(marks::again, again);
    next.erase(); // it emits nothing, and the bin ends with the other
  }
  convertItems(cast<ItemsOp>(*local), from, range.getBegin(), range.getEnd(),
               writer);
}

void UnitFormer::convertEmissions(WorkOpInterface piece, Value writer) {
  SmallVector<EmissionOpInterface> emits;
  piece->walk([&](EmissionOpInterface emit) { emits.push_back(emit); });
  auto stage = lookupInPipeline<StageOp>(piece, piece.getStageAttr());
  for (EmissionOpInterface emission : emits) {
    EmitOp emit = asEmit(emission);
    rewriter.setInsertionPoint(emit);
    auto record = cast<FlatSymbolRefAttr>(stage.getOutputs()[emit.getPort()]);
    Value stored = AppendOp::create(
        rewriter, emit.getLoc(), PrimType::get(rewriter.getContext(), record),
        writer, emit.getPortAttr(), emit.getValues());
    if (emit.getPrim()) {
      convertPlaces(emit.getPrim(), writer, emit.getPortAttr());
      rewriter.replaceAllUsesWith(emit.getPrim(), stored);
    }
    rewriter.eraseOp(emit);
  }
}

void UnitFormer::convertPlaces(Value prim, Value writer, IntegerAttr port) {
  for (Operation *user : llvm::make_early_inc_range(prim.getUsers())) {
    auto place = dyn_cast<PlaceOp>(user);
    if (!place)
      continue;
    rewriter.setInsertionPoint(place);
    AppendBinOp::create(rewriter, place.getLoc(), writer, port,
                        place.getStageAttr(), place.getBin(), place.getTile());
    rewriter.eraseOp(place);
  }
}

/// What takes primitives that others take, too; null if nothing does.
static Operation *findWorkOfGPU(KernelOp kernel) {
  if (kernel.getPrecedes())
    return kernel;
  for (auto bins : kernel.getOps<BinsOp>())
    for (auto work : bins.getOps<WorkOpInterface>())
      if (work->hasAttr(marks::again))
        return work;
  return nullptr;
}

void FormUnitsPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    if (Operation *other = findWorkOfGPU(kernel)) {
      other->emitOpError("expected work for a CPU: what precedes other work is "
                         "a GPU's");
      return signalPassFailure();
    }
    for (Operation &op : llvm::make_early_inc_range(*kernel.getBodyBlock()))
      if (isa<BinsOp, ItemsOp>(op))
        UnitFormer(kernel, &op).run();
  }
}
