// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-plan-vectors: which loops become vectors, and what is made of them
// first.
//   1. Of each loop that lanes may share, a copy is looked at (IterationLanes),
//      flattened where that pays (LaneNests), and compared with scalar code
//      (LaneCandidate).
//   2. Loops that are written in order, and stand in no vector, become vectors
//      of iterations as well, by stream compaction where their work stands
//      under a condition (SequentialLoops).
//   3. What is decided for is marked (`marks::vectorLanes`), for
//   piko-vectorize.
//
// A parallel loop that turns out to have fewer iterations than a quarter of the
// lanes, or two, runs as it was: a vector takes about as long.
//
// With a window, up to six loops of a kernel are held in both versions (loop
// multiversioning), of which the runtime measures which is faster. Loops in the
// scalar version are candidates of their own, so that primitives, iterations or
// neither may have lanes. What the schedule specifies is not measured.
//
// The CPU target sets the number of lanes from the processor
// (lib/Target/CPU/Processor.cpp): 16 with AVX-512 (F, BW, DQ and VL), 8 with
// AVX2, else 4. Of the passes before this one, only piko-narrow-integers knows
// it. An object for several processors has code of each width.

#include "Piko/Transforms/Storage/Appends.h"
#include "Piko/Transforms/Storage/CountedWhiles.h"
#include "Vectorize/Analysis/LaneArrays.h"
#include "Vectorize/Analysis/LoopStreams.h"
#include "Vectorize/Cost/LaneCycles.h"
#include "Vectorize/Cost/LaneLatency.h"
#include "Vectorize/LaneCandidate.h"
#include "Vectorize/Shape/LaneNests.h"
#include "Vectorize/Shape/LaneQuotients.h"
#include "Vectorize/Shape/SequentialLoops.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "llvm/Support/JSON.h"
#include "llvm/Support/Path.h"

#include <cmath>

namespace piko {
#define GEN_PASS_DEF_PLANVECTORS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct PlanVectorsPass : piko::impl::PlanVectorsBase<PlanVectorsPass> {
  using PlanVectorsBase::PlanVectorsBase;
  void runOnOperation() override;

private:
  void planLoops(Operation *root);
  /// What lanes are given of a loop; whether loops inside of it are left.
  WalkResult visit(Operation *op);
  /// Of a loop of a phase that is written in order; whether it did.
  bool planInOrder(Operation *op);
  bool planCompacted(scf::ForOp loop);
  /// Has `loop` written as vectors, with what is left of `scalar`, which does
  /// the same, for a few iterations, or unless `takesVectors`.
  void plan(scf::ForOp loop, int64_t count, scf::ForOp scalar,
            Value takesVectors = {});
  void plan(scf::ForOp loop, int64_t count) { plan(loop, count, {}); }
  /// Whether a loop may be held in two versions.
  bool mayHoldBoth(scf::ForOp loop) const;
  int64_t countLanes(const LaneCandidate &candidate) const {
    return candidate.isPaired() ? 2 * laneCount : int64_t(laneCount);
  }
};

} // namespace

/// With fewer iterations a loop runs as it was: a vector takes about as long as
/// this many.
static int64_t getLeastIterations(int64_t laneCount) {
  return std::max<int64_t>(laneCount / 4, 2);
}

void PlanVectorsPass::plan(scf::ForOp loop, int64_t count, scf::ForOp scalar,
                           Value takesVectors) {
  Location loc = loop.getLoc();
  OpBuilder builder(loop);
  loop->setAttr(marks::vectorLanes, builder.getI64IntegerAttr(count));
  if (isOverPrimitives(loop) ||
      (isOneVector(loop, laneCount) && !takesVectors)) {
    // A second body would take longer to compile than it saves.
    if (scalar)
      scalar.erase();
    return;
  }
  if (!scalar) {
    scalar = cast<scf::ForOp>(builder.clone(*loop));
    scalar->removeAttr(marks::vectorLanes);
    expandPushes(scalar);
  }
  Type type = loop.getUpperBound().getType();
  Value least = arith::ConstantOp::create(
      builder, loc, builder.getIntegerAttr(type, getLeastIterations(count)));
  Value iterations = arith::SubIOp::create(builder, loc, loop.getUpperBound(),
                                           loop.getLowerBound());
  Value isLong = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::sge,
                                       iterations, least);
  if (takesVectors)
    isLong = arith::AndIOp::create(builder, loc, takesVectors, isLong);
  auto choice = scf::IfOp::create(builder, loc, isLong, /*withElse=*/true);
  scalar->removeAttr(marks::lanes);
  loop->moveBefore(choice.thenBlock()->getTerminator());
  scalar->moveBefore(choice.elseBlock()->getTerminator());
}

/// The place of a loop in the user's text, for reports: no path of a machine.
static std::string describePlace(scf::ForOp loop) {
  auto at = loop.getLoc()->findInstanceOf<FileLineColLoc>();
  if (!at)
    return "";
  StringRef file = llvm::sys::path::filename(at.getFilename().getValue());
  return (", " + file + ":" + Twine(at.getLine()) + ":" + Twine(at.getColumn()))
      .str();
}

/// What a loop is over, and where it is.
static std::string describeLoop(scf::ForOp loop) {
  std::string what = isOverPrimitives(loop)
                         ? (getLoopPhase(loop) + " of primitives").str()
                         : "iterations";
  return getKernelStage(loop).getSymName().str() + ", " + what +
         describePlace(loop);
}

/// The number of the loop in whose scalar version an operation is.
static std::optional<int64_t> findScalarVersion(Operation *op) {
  for (; op; op = op->getParentOp()) {
    auto choice = dyn_cast_if_present<scf::IfOp>(op->getParentOp());
    auto takes = choice ? choice.getCondition().getDefiningOp<TakesVectorsOp>()
                        : TakesVectorsOp();
    if (takes && op->getParentRegion() == &choice.getElseRegion())
      return takes.getNumber();
  }
  return std::nullopt;
}

/// The writer of a unit of work that a loop is in, or null.
static OpenWriterOp findWriter(scf::ForOp loop) {
  auto units = loop->getParentOfType<scf::ForallOp>();
  if (!units || !units->getParentOfType<KernelOp>())
    return {};
  auto writers = units.getBody()->getOps<OpenWriterOp>();
  return writers.empty() ? OpenWriterOp() : *writers.begin();
}

static int64_t countMappings(scf::ForOp loop) {
  int64_t count = 0;
  loop->getParentOfType<KernelOp>().walk([&](TakesVectorsOp) { ++count; });
  return count;
}

/// A trial takes longer for each of them: of more, estimates decide.
static constexpr int64_t mostHeld = 6;
static_assert(mostHeld <= mostMappings);

bool PlanVectorsPass::mayHoldBoth(scf::ForOp loop) const {
  return window > 1 && !inTurns && !loop->hasAttr(marks::barriers) &&
         findWriter(loop) && countMappings(loop) < mostHeld;
}

/// Whether a unit of work runs a loop as vectors; null if only they are held.
static Value createTakesVectors(scf::ForOp loop,
                                const LaneCandidate &candidate) {
  if (!candidate.getVersions())
    return {};
  int64_t number = countMappings(loop);
  OpenWriterOp writer = findWriter(loop);
  OpBuilder builder(loop->getContext());
  builder.setInsertionPointAfter(writer);
  const LaneCandidate::Versions &versions = *candidate.getVersions();
  auto optional = [&](std::optional<int64_t> number) {
    return number ? builder.getI64IntegerAttr(*number) : IntegerAttr();
  };
  return TakesVectorsOp::create(
      builder, loop.getLoc(), builder.getI1Type(), writer,
      builder.getI64IntegerAttr(number), optional(findScalarVersion(loop)),
      versions.expected ? builder.getUnitAttr() : UnitAttr(),
      builder.getI64IntegerAttr(std::llround(versions.vectors)),
      builder.getI64IntegerAttr(std::llround(versions.scalar)),
      builder.getStringAttr(describeLoop(loop)));
}

/// Prints the estimates of a loop that is held in two versions, as a line of
/// JSON, and how they depend on the numbers of the cost model: for each of
/// these by how many percent estimates change if it does so by one.
static void printSensitivities(scf::ForOp loop, int64_t number,
                               LaneCandidate &candidate,
                               const IterationLanes &lanes,
                               const FlatLoop &flat) {
  const Cycles &cycles = getCycles(lanes.getLaneCount());
  LaneCandidate::Versions at = candidate.estimate(lanes, flat, cycles);
  llvm::json::OStream out(llvm::outs());
  out.objectBegin();
  out.attribute("kernel", loop->getParentOfType<KernelOp>().getSymName().str());
  out.attribute("number", number);
  out.attribute("loop", describeLoop(loop));
  out.attribute("expected", candidate.getVersions()->expected);
  out.attribute("vectors", at.vectors);
  out.attribute("scalar", at.scalar);
  out.attributeBegin("by");
  out.objectBegin();
  for (const CycleConstant &constant : getCycleConstants()) {
    constexpr double step = 0.01;
    Cycles other = cycles;
    other.*constant.member *= 1 + step;
    LaneCandidate::Versions there = candidate.estimate(lanes, flat, other);
    double vectors = (there.vectors / at.vectors - 1) / step,
           scalar = (there.scalar / at.scalar - 1) / step;
    if (vectors == 0 && scalar == 0)
      continue;
    out.attributeBegin(constant.name);
    out.array([&] {
      out.value(vectors);
      out.value(scalar);
    });
    out.attributeEnd();
  }
  out.objectEnd();
  out.attributeEnd();
  out.objectEnd();
  llvm::outs() << "\n";
}

/// Makes room for two versions of a loop: `loop`, whose lanes are given
/// iterations of loops in it, is the scalar one; the others are before.
static void splitVersions(Value takesVectors, scf::ForOp loop,
                          ArrayRef<scf::ForOp> vectors) {
  OpBuilder builder(loop);
  auto choice = scf::IfOp::create(builder, loop.getLoc(), takesVectors,
                                  /*withElse=*/true);
  if (isOverPrimitives(loop))
    choice->setAttr(marks::versions, builder.getUnitAttr());
  for (scf::ForOp one : vectors)
    if (one)
      one->moveBefore(choice.thenBlock()->getTerminator());
  loop->moveBefore(choice.elseBlock()->getTerminator());
  loop->setAttr(marks::mapping, LaneMappingAttr::get(loop->getContext(),
                                                     LaneMapping::Iterations));
}

/// A copy of a loop that is written in order, as one that counts and hands on
/// nothing; lists that it appends to are pushed to, unless `pushes` is false.
static std::optional<PushLoop> copyAsCount(Operation *op, bool pushes) {
  if (!pushes && isa<scf::ForOp>(op) && op->getNumResults() > 0)
    return std::nullopt;
  if (!pushes && isa<scf::WhileOp>(op) && op->getNumResults() > 1)
    return std::nullopt;
  std::optional<Location> refusal;
  std::optional<PushLoop> made = copyAsPushes(op, refusal);
  if (refusal) {
    InFlightDiagnostic remark = remarkStage(op);
    explainNoPushes(remark, *refusal);
  }
  return made;
}

static bool appends(scf::ForOp loop) {
  return loop->walk([](PushOp) { return WalkResult::interrupt(); })
      .wasInterrupted();
}

static void remarkInOrder(scf::ForOp loop, int64_t laneCount, bool isCompact) {
  InFlightDiagnostic remark = remarkStage(loop);
  remark << "iterations of this loop "
         << (appends(loop) ? "append in order, by stream compaction"
                           : "do not depend on one another")
         << ", and are vectorized for " << laneCount << " at once";
  if (isCompact)
    remark << ", of those that have something to do";
}

/// Plans vectors of those iterations of a loop that have something to do, if
/// most work is theirs.
bool PlanVectorsPass::planCompacted(scf::ForOp loop) {
  std::optional<Compaction> made = compact(loop);
  if (!made)
    return false;
  IterationLanes finds(made->finds, laneCount), does(made->does, laneCount);
  if (does.getRefusal().at || !does.getCost().isWorthwhile()) {
    made->strips.erase();
    return false;
  }
  remarkInOrder(loop, laneCount, /*isCompact=*/true);
  plan(made->does, laneCount);
  if (!finds.getRefusal().at && finds.getCost().isWorthwhile())
    plan(made->finds, laneCount);
  loop.erase();
  return true;
}

bool PlanVectorsPass::planInOrder(Operation *op) {
  if (!isa<scf::ForOp, scf::WhileOp>(op)) // before what takes longer
    return false;
  StageOp stage = getKernelStage(op);
  if (!stage || !op->getParentOfType<scf::ForallOp>() ||
      (stage.getSchedule() &&
       stage.getSchedule().getLanes() == LaneMapping::One))
    return false;
  std::optional<PushLoop> copied = copyAsCount(op, /*pushes=*/compacts);
  if (!copied)
    return false;
  scf::ForOp copy = copied->loop;
  upliftWhiles(copy);
  if (!mayRunInOrder(copy, laneCount)) {
    copied->erase();
    return false;
  }
  auto replace = [&] {
    op->replaceAllUsesWith(copied->results);
    op->erase();
    return true;
  };
  if (compacts && planCompacted(copy))
    return replace();
  IterationLanes lanes(copy, laneCount);
  IterationLanes::Cost cost = lanes.getCost();
  if (lanes.getRefusal().at || !cost.computes ||
      !isSurelyFaster(cost, laneCount)) {
    copied->erase();
    return false;
  }
  bool isPaired =
      laneCount == widestLanes && !appends(copy) && isBoundByLatency(lanes);
  remarkInOrder(copy, (isPaired ? 2 : 1) * laneCount, /*isCompact=*/false);
  testDivisors(lanes);
  replace();
  padLists(copy, laneCount);
  plan(copy, (isPaired ? 2 : 1) * laneCount);
  return true;
}

WalkResult PlanVectorsPass::visit(Operation *op) {
  if (op->hasAttr(marks::vectorLanes)) // by a run before
    return WalkResult::skip();
  auto loop = dyn_cast<scf::ForOp>(op);
  if (!loop || !loop->hasAttr(marks::lanes))
    return planInOrder(op) ? WalkResult::skip() : WalkResult::advance();
  LaneCandidate candidate(loop, mayHoldBoth(loop) ? double(window) : 1);
  if (!candidate.isChosen())
    return WalkResult::advance();
  // Of a copy: what stays scalar stays as it is.
  auto copy = cast<scf::ForOp>(OpBuilder(loop).clone(*loop));
  upliftWhiles(copy);
  readAllElements(copy);
  copyItemArrays(copy);
  IterationLanes lanes(copy, laneCount);
  FlatLoop flat;
  if (flattens && !lanes.getRefusal().at)
    flat = flattenNests(lanes, mergeGain);
  bool isDone = candidate.decide(lanes, flat);
  if (sensitivities && isDone && candidate.getVersions())
    printSensitivities(loop, countMappings(loop), candidate, lanes, flat);
  Value takesVectors = isDone ? createTakesVectors(loop, candidate) : Value();
  // One body stands for short loops and for the scalar version.
  bool isSplit = takesVectors && (isOverPrimitives(loop) ||
                                  isOneVector(loop, countLanes(candidate)));
  if (isSplit)
    splitVersions(std::exchange(takesVectors, Value()), loop,
                  {copy, flat.loop});
  if (isDone && flat.loop) {
    countPrimitives(copy, flat.writers);
    plan(flat.loop, countLanes(candidate), copy, takesVectors);
  } else if (isDone) {
    testDivisors(lanes);
    testDividends(copy);
    plan(copy, countLanes(candidate), {}, takesVectors);
  } else {
    copy.erase();
  }
  if (flat.loop && !isDone)
    flat.loop.erase();
  if (!isDone || isSplit)
    return WalkResult::advance();
  loop.erase();
  return WalkResult::skip();
}

/// Loops inside of one that becomes vectors are parts of it.
void PlanVectorsPass::planLoops(Operation *root) {
  root->walk<WalkOrder::PreOrder>([&](Operation *op) {
    return op == root ? WalkResult::advance() : visit(op);
  });
}

void PlanVectorsPass::runOnOperation() {
  if (!llvm::is_contained({4, 8, 16}, laneCount)) {
    getOperation().emitError("expected 4, 8 or 16 lanes, but got ")
        << int64_t(laneCount);
    return signalPassFailure();
  }
  if (!inTurns) {
    planLoops(getOperation());
    getOperation().walk(
        [](scf::ForOp loop) { loop->removeAttr(marks::barriers); });
    return;
  }
  SmallVector<Operation *> turns;
  getOperation().walk([&](scf::WhileOp loop) {
    if (loop->removeAttr(marks::turns))
      turns.push_back(loop);
  });
  for (Operation *loop : turns)
    planLoops(loop);
}
