// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-vectorize: primitives, or the iterations of a parallel loop, as lanes.
//   1. Parallel loops whose iterations meet become lanes in lockstep, if they
//      have up to 16 (IterationBarriers), or are cut as piko-split-loops cuts
//      them.
//   2. Of each loop that lanes may share, a copy is looked at (IterationLanes),
//      flattened where that pays (LaneNests), and compared with scalar code
//      (LaneCandidate).
//   3. Loops that are written in order, and stand in no vector, become vectors
//      of iterations as well, by stream compaction where their work stands
//      under a condition (SequentialLoops).
//   4. What is decided for is written (IterationWriter).
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

#include "Piko/Transforms/Storage/LoopSplitter.h"
#include "Piko/Transforms/Storage/ParallelLoops.h"
#include "Vectorize/Analysis/LaneArrays.h"
#include "Vectorize/Analysis/LoopStreams.h"
#include "Vectorize/Cost/LaneCycles.h"
#include "Vectorize/Cost/LaneLatency.h"
#include "Vectorize/LaneCandidate.h"
#include "Vectorize/Shape/LaneNests.h"
#include "Vectorize/Shape/LaneQuotients.h"
#include "Vectorize/Shape/SequentialLoops.h"
#include "Vectorize/Write/IterationWriter.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/Matchers.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"
#include "llvm/Support/JSON.h"
#include "llvm/Support/Path.h"
#include "llvm/Support/SaveAndRestore.h"

#include <cmath>

namespace piko {
#define GEN_PASS_DEF_VECTORIZE
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct VectorizePass : piko::impl::VectorizeBase<VectorizePass> {
  using VectorizeBase::VectorizeBase;
  void runOnOperation() override;

private:
  void vectorizeLoops(Operation *root);
  /// What lanes are given of a loop; whether loops inside of it are left.
  WalkResult visit(Operation *op);
  /// A loop of a phase that is written in order; whether it did.
  bool vectorizeInOrder(Operation *op);
  bool vectorizeCompacted(scf::ForOp loop);
  /// Makes vectors of a loop, with what is left of `scalar`, which does the
  /// same, for a few iterations, or unless `takesVectors`.
  void vectorize(const IterationLanes &lanes, scf::ForOp scalar,
                 Value takesVectors = {});
  /// Whether a loop may be held in two versions.
  bool mayHoldBoth(scf::ForOp loop) const;
  void vectorize(const IterationLanes &lanes) {
    vectorize(lanes, lanes.getLoop());
  }
  bool inVectors = false;              ///< In turns that lanes take.
  llvm::DenseSet<Operation *> meeting; ///< loops around iterations that meet
  int64_t countLanes(const LaneCandidate &candidate) const {
    return candidate.isPaired() ? 2 * laneCount : int64_t(laneCount);
  }
};

} // namespace

namespace {

/// How a loop counts by one: which of its variables, below which bound, and
/// whether it takes the bound as well.
struct CountedWhile {
  unsigned variable = 0;
  Value bound;
  bool isClosed = false;
};

} // namespace

static std::optional<CountedWhile> findCountedWhile(scf::WhileOp loop) {
  Block &before = *loop.getBeforeBody(), &after = *loop.getAfterBody();
  scf::ConditionOp condition = loop.getConditionOp();
  auto compare = dyn_cast<arith::CmpIOp>(before.front());
  if (!compare || compare->getNextNode() != condition ||
      condition.getCondition() != compare.getResult() ||
      !llvm::equal(condition.getArgs(), before.getArguments()) ||
      compare.getRhs().getParentBlock() == &before)
    return {};
  auto variable = dyn_cast<BlockArgument>(compare.getLhs());
  if (!variable || variable.getOwner() != &before)
    return {};
  using P = arith::CmpIPredicate;
  CountedWhile counting{variable.getArgNumber(), compare.getRhs(),
                        compare.getPredicate() == P::sle};
  // Up to a number, from 0: one below it would take 2^63 iterations.
  bool isUntil = compare.getPredicate() == P::ne &&
                 counting.bound.getType().isInteger(64) &&
                 matchPattern(loop.getInits()[counting.variable], m_Zero());
  auto next = after.getTerminator()
                  ->getOperand(counting.variable)
                  .getDefiningOp<arith::AddIOp>();
  bool isCounted =
      next && next.getLhs() == after.getArgument(counting.variable) &&
      matchPattern(next.getRhs(), m_One()) &&
      (counting.isClosed || isUntil || compare.getPredicate() == P::slt);
  // The bound may be the largest number, where 64 bits have no next one.
  bool fits = !counting.isClosed || counting.bound.getType().isInteger(32);
  return isCounted && fits ? counting : std::optional<CountedWhile>();
}

static scf::ForOp countLoop(scf::WhileOp loop, const CountedWhile &counting) {
  IRRewriter builder(loop->getContext());
  builder.setInsertionPoint(loop);
  Location loc = loop.getLoc();
  Type index = builder.getIndexType(), type = counting.bound.getType();
  auto cast = [&](Value number, Type type) -> Value {
    return number.getType() == type
               ? number
               : builder.createOrFold<arith::IndexCastOp>(loc, type, number);
  };
  SmallVector<Value> inits(loop.getInits());
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  Value lower = cast(inits[counting.variable], index),
        upper = cast(counting.bound, index);
  if (counting.isClosed)
    upper = arith::AddIOp::create(builder, loc, upper, one);
  inits.erase(inits.begin() + counting.variable);
  auto made = scf::ForOp::create(builder, loc, lower, upper, one, inits);
  Block *body = made.getBody(), *from = loop.getAfterBody();
  if (!body->empty())
    builder.eraseOp(body->getTerminator());
  builder.setInsertionPointToStart(body);
  SmallVector<Value> variables(made.getRegionIterArgs());
  variables.insert(variables.begin() + counting.variable,
                   cast(made.getInductionVar(), type));
  Operation *yield = from->getTerminator();
  yield->eraseOperand(counting.variable);
  builder.inlineBlockBefore(from, body, body->end(), variables);
  builder.setInsertionPointAfter(made);
  SmallVector<Value> results(made.getResults());
  Value last = cast(arith::MaxSIOp::create(builder, loc, lower, upper), type);
  results.insert(results.begin() + counting.variable, last);
  builder.replaceOp(loop, results);
  // The bounds of loops inside stand outside of this one.
  moveLoopInvariantCode(made);
  return made;
}

/// Makes loops that count loops of which one knows how often they iterate, in
/// 64 bits.
static void countLoops(scf::ForOp root) {
  SmallVector<scf::WhileOp> loops;
  root.walk([&](scf::WhileOp loop) { loops.push_back(loop); });
  for (scf::WhileOp loop : loops)
    if (std::optional<CountedWhile> counting = findCountedWhile(loop))
      countLoop(loop, *counting);
}

/// With fewer iterations a loop runs as it was: a vector takes about as long as
/// this many.
static int64_t getLeastIterations(int64_t laneCount) {
  return std::max<int64_t>(laneCount / 4, 2);
}

/// Loops that one lane after the other runs are made vectors, too.
void VectorizePass::vectorize(const IterationLanes &lanes, scf::ForOp scalar,
                              Value takesVectors) {
  scf::ForOp loop = lanes.getLoop();
  Location loc = loop.getLoc();
  OpBuilder builder(loop);
  IterationWriter writer(lanes);
  auto write = [&] {
    writer.write(builder.saveInsertionPoint());
    llvm::SaveAndRestore scope(inVectors, true);
    for (scf::WhileOp turns : writer.getTurnLoops())
      vectorizeLoops(turns);
  };
  if (isOverPrimitives(loop) ||
      (isOneVector(loop, laneCount) && !takesVectors)) {
    // A second body would take longer to compile than it saves.
    write();
    scalar.erase();
    return;
  }
  Type type = loop.getUpperBound().getType();
  Value least = arith::ConstantOp::create(
      builder, loc,
      builder.getIntegerAttr(type, getLeastIterations(lanes.getLaneCount())));
  Value count = arith::SubIOp::create(builder, loc, loop.getUpperBound(),
                                      loop.getLowerBound());
  Value isLong = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::sge,
                                       count, least);
  if (takesVectors)
    isLong = arith::AndIOp::create(builder, loc, takesVectors, isLong);
  auto choice = scf::IfOp::create(builder, loc, isLong, /*withElse=*/true);
  scalar->removeAttr(marks::lanes);
  builder.setInsertionPointToStart(choice.thenBlock());
  write();
  scalar->moveBefore(choice.elseBlock(), choice.elseBlock()->begin());
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

bool VectorizePass::mayHoldBoth(scf::ForOp loop) const {
  return window > 1 && !inVectors && !meeting.contains(loop) &&
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

/// Whether the iterations of a loop, which meet, are now lanes in lockstep.
static bool runInLockstep(ParallelForOp parallel) {
  std::optional<int64_t> count = getConstantIntValue(parallel.getCount());
  if (!count || *count > 16)
    return false;
  auto copy = cast<ParallelForOp>(OpBuilder(parallel).clone(*parallel));
  scf::ForOp loop =
      convertLoop(cast<ParallelLoopOpInterface>(*hoistInvariants(copy)));
  LaneCandidate candidate(loop);
  countLoops(loop);
  readAllElements(loop);
  copyItemArrays(loop);
  int64_t laneCount = std::max<int64_t>(llvm::PowerOf2Ceil(*count), 4);
  IterationLanes lanes(loop, laneCount);
  bool isDone = candidate.isChosen() && candidate.decide(lanes);
  if (isDone) {
    IterationWriter(lanes).write(OpBuilder(loop).saveInsertionPoint());
    parallel.erase();
  }
  loop.erase();
  return isDone;
}

/// A copy of a loop that is written in order and hands on nothing, as one that
/// counts; null if it is another.
static scf::ForOp copyAsCount(Operation *op) {
  OpBuilder builder(op);
  if (auto loop = dyn_cast<scf::ForOp>(op))
    return loop.getNumResults() == 0 ? cast<scf::ForOp>(builder.clone(*loop))
                                     : scf::ForOp();
  auto loop = dyn_cast<scf::WhileOp>(op);
  if (!loop || loop.getInits().size() != 1 || !loop->use_empty() ||
      !findCountedWhile(loop))
    return {};
  auto copy = cast<scf::WhileOp>(builder.clone(*loop));
  return countLoop(copy, *findCountedWhile(copy));
}

static void remarkInOrder(scf::ForOp loop, int64_t laneCount, bool isCompact) {
  InFlightDiagnostic remark = remarkStage(loop);
  remark << "iterations of this loop do not depend on one another, and are "
            "vectorized for "
         << laneCount << " at once";
  if (isCompact)
    remark << ", of those that have something to do";
}

/// Vectorizes those iterations of a loop that have something to do, if most
/// work is theirs.
bool VectorizePass::vectorizeCompacted(scf::ForOp loop) {
  std::optional<Compaction> made = compact(loop);
  if (!made)
    return false;
  IterationLanes finds(made->finds, laneCount), does(made->does, laneCount);
  if (does.getRefusal().at || !does.getCost().isWorthwhile()) {
    made->strips.erase();
    return false;
  }
  remarkInOrder(loop, laneCount, /*isCompact=*/true);
  vectorize(does);
  if (!finds.getRefusal().at && finds.getCost().isWorthwhile())
    vectorize(finds);
  loop.erase();
  return true;
}

bool VectorizePass::vectorizeInOrder(Operation *op) {
  if (!isa<scf::ForOp, scf::WhileOp>(op)) // before what takes longer
    return false;
  StageOp stage = getKernelStage(op);
  if (!stage || !op->getParentOfType<scf::ForallOp>() ||
      (stage.getSchedule() &&
       stage.getSchedule().getLanes() == LaneMapping::One))
    return false;
  scf::ForOp copy = copyAsCount(op);
  if (!copy)
    return false;
  countLoops(copy);
  if (!mayRunInOrder(copy, laneCount)) {
    copy.erase();
    return false;
  }
  if (!vectorizeCompacted(copy)) {
    IterationLanes lanes(copy, laneCount);
    IterationLanes::Cost cost = lanes.getCost();
    if (lanes.getRefusal().at || !cost.computes ||
        !isSurelyFaster(cost, laneCount)) {
      copy.erase();
      return false;
    }
    bool isPaired = laneCount == widestLanes && isBoundByLatency(lanes);
    remarkInOrder(copy, (isPaired ? 2 : 1) * laneCount, /*isCompact=*/false);
    testDivisors(lanes);
    vectorize(IterationLanes(copy, (isPaired ? 2 : 1) * laneCount));
  }
  op->erase();
  return true;
}

WalkResult VectorizePass::visit(Operation *op) {
  auto loop = dyn_cast<scf::ForOp>(op);
  if (!loop || !loop->hasAttr(marks::lanes))
    return vectorizeInOrder(op) ? WalkResult::skip() : WalkResult::advance();
  LaneCandidate candidate(loop, mayHoldBoth(loop) ? double(window) : 1);
  if (!candidate.isChosen())
    return WalkResult::advance();
  // Of a copy: what stays scalar stays as it is.
  auto copy = cast<scf::ForOp>(OpBuilder(loop).clone(*loop));
  countLoops(copy);
  readAllElements(copy);
  copyItemArrays(copy);
  IterationLanes lanes(copy, laneCount);
  FlatLoop flat;
  if (!lanes.getRefusal().at)
    flat = flattenNests(lanes);
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
    vectorize(IterationLanes(flat.loop, countLanes(candidate)), copy,
              takesVectors);
  } else if (isDone) {
    testDivisors(lanes);
    testDividends(copy);
    vectorize(IterationLanes(copy, countLanes(candidate)), copy, takesVectors);
  } else {
    copy.erase();
  }
  if (flat.loop)
    flat.loop.erase();
  if (!isDone || isSplit)
    return WalkResult::advance();
  loop.erase();
  return WalkResult::skip();
}

/// Loops inside of one that is vectorized are parts of it.
void VectorizePass::vectorizeLoops(Operation *root) {
  root->walk<WalkOrder::PreOrder>([&](Operation *op) {
    return op == root ? WalkResult::advance() : visit(op);
  });
}

void VectorizePass::runOnOperation() {
  if (!llvm::is_contained({4, 8, 16}, laneCount)) {
    getOperation().emitError("expected 4, 8 or 16 lanes, but got ")
        << int64_t(laneCount);
    return signalPassFailure();
  }
  meeting.clear(); // of another pipeline
  SmallVector<ParallelForOp> parallels;
  getOperation().walk([&](ParallelForOp parallel) {
    if (!parallel->getParentOfType<KernelOp>())
      return;
    parallels.push_back(parallel);
    for (Operation *at = parallel; at; at = at->getParentOp())
      if (isa<scf::ForOp>(at))
        meeting.insert(at);
  });
  for (ParallelForOp parallel : parallels)
    if (!runInLockstep(parallel) && failed(LoopSplitter(parallel).run()))
      return signalPassFailure();
  vectorizeLoops(getOperation());
}
