// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-map-lanes, for each piece of work:
//   1. find its parallel loops, how many iterations they have, and what is
//      around them;
//   2. find what rules a mapping out;
//   3. take what the stage's schedule says, or what costs least.

#include "Piko/Analysis/Expectations.h"
#include "Piko/Analysis/TargetModel.h"
#include "Piko/Analysis/Uniformity.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/IR/Matchers.h"
#include "llvm/Support/FormatVariadic.h"
#include "llvm/Support/MathExtras.h"

namespace piko {
#define GEN_PASS_DEF_MAPLANES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Costs
//===----------------------------------------------------------------------===//

/// A warp of a GPU; two vectors of a CPU with AVX-512.
constexpr int64_t lanes = warpSize;
/// To find the primitive of a pair: the five steps of a scan over 32 counts,
/// and the five of a search in them.
constexpr int64_t pairCost = 10;
/// To put an update after those of the same pixel in lanes in front: a
/// comparison with each of them, 16 on average.
constexpr int64_t orderCost = lanes / 2;

namespace {

/// A parallel loop that is not in another one.
struct LaneLoop {
  Operation *loop;
  bool isKnown = false;   ///< whether `most` is exact
  int64_t most = 0;       ///< iterations of the longest of 32 primitives
  int64_t expected = 0;   ///< iterations on average
  int64_t operations = 0; ///< of an iteration
  int64_t values = 0;     ///< what an iteration takes that items differ in
  int64_t updates = 0;    ///< of an iteration
  int64_t times = 1;      ///< that it runs for a primitive, as far as is known
};

/// What a primitive or a list asks for.
struct LaneWork {
  explicit LaneWork(WorkOpInterface work);

  /// Why lanes cannot be given that; empty where they can.
  std::string getObstacle(LaneMapping mapping) const;
  bool isPossible(LaneMapping mapping) const {
    return getObstacle(mapping).empty();
  }
  /// How many operations each lane has time for while 32 items are done.
  int64_t getCost(LaneMapping mapping) const;
  LaneMapping getBest() const;

  WorkOpInterface work;
  SmallVector<LaneLoop> loops;
  int64_t operations = 0, updates = 0; ///< outside of the loops
  Operation *effect = nullptr;         ///< the first one outside of the loops
  Operation *unknown = nullptr;        ///< what may have to be done in order

private:
  void count(Operation *op);
  void addLoop(Operation *loop, const Uniformity &uniformity);
  void countIterations(LaneLoop &entry, const Uniformity &uniformity);
};

struct MapLanesPass : piko::impl::MapLanesBase<MapLanesPass> {
  void runOnOperation() override;
  LogicalResult map(WorkOpInterface work);
  void remark(const LaneWork &work, StageOp stage, LaneMapping chosen,
              bool isSpecified);
};

} // namespace

//===----------------------------------------------------------------------===//
// Work
//===----------------------------------------------------------------------===//

/// Whether an operation changes what others see, in a way that is known.
static bool isKnownEffect(Operation *op) {
  if (auto access = dyn_cast<StateAccessOpInterface>(op))
    return access.getAccessKinds() != StateAccess::reads;
  return isa<EmissionOpInterface, PlaceOp>(op);
}

/// Whether lanes may do an operation side by side.
static bool mayShareLanes(Operation *op) {
  if (isMemoryEffectFree(op) || isKnownEffect(op) ||
      op->hasTrait<OpTrait::HasRecursiveMemoryEffects>() ||
      op->hasTrait<OpTrait::IsTerminator>() ||
      isa<StateAccessOpInterface, BarrierOpInterface, ParallelLoopOpInterface,
          ListAtOp>(op))
    return true;
  // Arrays of a call are its own.
  auto effects = dyn_cast<MemoryEffectOpInterface>(op);
  SmallVector<MemoryEffects::EffectInstance> found;
  if (effects)
    effects.getEffects(found);
  return effects && llvm::all_of(found, [](auto &effect) {
           return effect.getValue() &&
                  isa<MemRefType>(effect.getValue().getType());
         });
}

/// How often an operation is taken to run each time that `root` does.
static int64_t getTimes(Operation *op, Operation *root) {
  for (Operation *at = op->getParentOp(); at != root; at = at->getParentOp())
    if (isa<LoopLikeOpInterface, ParallelLoopOpInterface>(at))
      return expected::iterations;
  return 1;
}

static int64_t getWeight(Operation *op, Operation *root) {
  bool isFree = op->getNumRegions() || op->hasTrait<OpTrait::IsTerminator>() ||
                op->hasTrait<OpTrait::ConstantLike>();
  return isFree ? 0 : getTimes(op, root);
}

LaneWork::LaneWork(WorkOpInterface work) : work(work) {
  Uniformity uniformity(work);
  work->walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (op == work)
      return WalkResult::advance();
    if (isa<ParallelLoopOpInterface>(op)) {
      addLoop(op, uniformity);
      return WalkResult::skip();
    }
    count(op);
    operations += getWeight(op, work);
    updates += isa<UpdateOp>(op);
    if (!effect && isKnownEffect(op))
      effect = op;
    return WalkResult::advance();
  });
}

void LaneWork::count(Operation *op) {
  if (!unknown && !mayShareLanes(op))
    unknown = op;
}

void LaneWork::addLoop(Operation *loop, const Uniformity &uniformity) {
  LaneLoop entry{loop};
  entry.times = getTimes(loop, work);
  llvm::DenseSet<Value> taken;
  loop->walk([&](Operation *op) {
    if (op == loop)
      return;
    count(op);
    entry.operations += getWeight(op, loop);
    entry.updates += isa<UpdateOp>(op);
    for (Value operand : op->getOperands())
      if (!loop->isAncestor(operand.getParentRegion()->getParentOp()) &&
          !uniformity.isSameForBin(operand) && taken.insert(operand).second)
        ++entry.values;
  });
  countIterations(entry, uniformity);
  loops.push_back(entry);
}

void LaneWork::countIterations(LaneLoop &entry, const Uniformity &uniformity) {
  auto known = [](Value value) -> std::optional<int64_t> {
    APInt constant;
    if (!matchPattern(value, m_ConstantInt(&constant)))
      return std::nullopt;
    return constant.getSExtValue();
  };
  entry.isKnown = true;
  entry.most = entry.expected = 1;
  if (auto loop = dyn_cast<ParallelForOp>(entry.loop)) {
    std::optional<int64_t> count = known(loop.getCount());
    entry.isKnown = count.has_value();
    entry.most =
        std::max<int64_t>(0, count.value_or(expected::parallelIterations));
    bool differs = !count && !uniformity.isSameForBin(loop.getCount());
    entry.expected =
        differs ? entry.most / expected::longestToMean : entry.most;
    return;
  }
  auto pixels = dyn_cast<ParallelPixelsOp>(entry.loop);
  if (!pixels) { // another loop of which only the interface is known
    entry.isKnown = false;
    entry.most = expected::parallelIterations;
    entry.expected = entry.most / expected::longestToMean;
    return;
  }
  StageOp stage = getKernelStage(work);
  for (auto [dim, lo, hi] : llvm::enumerate(pixels.getLo(), pixels.getHi())) {
    std::optional<int64_t> from = known(lo), to = known(hi);
    if (from && to) {
      entry.most *= std::max<int64_t>(0, *to - *from);
      entry.expected *= std::max<int64_t>(0, *to - *from);
      continue;
    }
    entry.isKnown = false;
    int64_t extent = stage.getBins()[dim];
    if (!extent)
      extent = expected::binExtent;
    bool differs = !uniformity.isSameForBin(lo) || !uniformity.isSameForBin(hi);
    entry.most *= extent;
    // The distance of two random points of a bin.
    entry.expected *= differs ? std::max<int64_t>(1, extent / 3) : extent;
  }
}

//===----------------------------------------------------------------------===//
// Mappings
//===----------------------------------------------------------------------===//

std::string LaneWork::getObstacle(LaneMapping mapping) const {
  if (mapping == LaneMapping::One)
    return "";
  if (unknown)
    return ("'" + unknown->getName().getStringRef() +
            "' is done in order of lineage")
        .str();
  if (mapping == LaneMapping::Iterations)
    return loops.empty() ? "there is no parallel loop" : "";
  if (WorkOpInterface(work).takesList())
    return "a list is one item";
  for (const LaneLoop &entry : loops)
    if (cast<ParallelLoopOpInterface>(entry.loop).hasBarriers())
      return "the iterations of a parallel loop meet";
  if (mapping == LaneMapping::Items)
    return "";
  if (loops.size() != 1)
    return loops.empty() ? "there is no parallel loop"
                         : "there are several parallel loops";
  for (Operation *at = loops.front().loop->getParentOp(); at != work;
       at = at->getParentOp())
    if (!isa<scf::IfOp, scf::IndexSwitchOp>(at))
      return ("the parallel loop is inside '" + at->getName().getStringRef() +
              "'")
          .str();
  return effect ? "there are effects outside of the parallel loop" : "";
}

int64_t LaneWork::getCost(LaneMapping mapping) const {
  bool isOne = mapping == LaneMapping::One;
  if (isOne || mapping == LaneMapping::Iterations) {
    int64_t cost = operations;
    for (const LaneLoop &loop : loops)
      cost += loop.times * loop.operations *
              (isOne ? loop.expected : llvm::divideCeil(loop.expected, lanes));
    return lanes * cost;
  }
  int64_t cost = operations + updates * orderCost;
  for (const LaneLoop &loop : loops) {
    int64_t iteration = loop.operations + loop.updates * orderCost;
    if (mapping == LaneMapping::Items)
      cost += loop.times * loop.most * iteration;
    else
      cost += loop.times * loop.expected * (iteration + pairCost + loop.values);
  }
  return cost;
}

LaneMapping LaneWork::getBest() const {
  LaneMapping best = LaneMapping::One;
  // Of two with the same cost the simpler one.
  for (LaneMapping mapping :
       {LaneMapping::Items, LaneMapping::Iterations, LaneMapping::Collapsed})
    if (isPossible(mapping) &&
        (best == LaneMapping::One || getCost(mapping) < getCost(best)))
      best = mapping;
  return best;
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

constexpr LaneMapping allMappings[] = {
    LaneMapping::Items, LaneMapping::Iterations, LaneMapping::Collapsed,
    LaneMapping::One};

static void describe(Diagnostic &note, const LaneLoop &loop,
                     const LaneWork &work) {
  note << "iterations of this parallel loop: " << (loop.isKnown ? "" : "about ")
       << loop.expected;
  if (loop.most != loop.expected)
    note << ", at most about " << loop.most;
  note << "; operations of each: " << loop.operations
       << ", around the loop: " << work.operations;
}

void MapLanesPass::remark(const LaneWork &work, StageOp stage,
                          LaneMapping chosen, bool isSpecified) {
  InFlightDiagnostic remark = emitRemark(work.work->getLoc())
                              << "stage '" << getCppName(stage)
                              << "': lanes are given "
                              << stringifyLaneMapping(chosen);
  if (isSpecified)
    remark << ", as is specified";
  else if (chosen == LaneMapping::Items && work.loops.empty())
    remark << ", because there is no parallel loop";
  else if (chosen == LaneMapping::One)
    remark << ", because "
           << (work.unknown ? work.getObstacle(LaneMapping::Items)
                            : "a list is one item and there is no parallel "
                              "loop");
  if (work.loops.empty())
    return;
  for (const LaneLoop &loop : work.loops)
    describe(remark.attachNote(loop.loop->getLoc()), loop, work);
  for (LaneMapping other : allMappings) {
    if (other == chosen || other == LaneMapping::One)
      continue;
    Diagnostic &note = remark.attachNote(work.work->getLoc());
    note << "not " << stringifyLaneMapping(other) << ": ";
    if (std::string obstacle = work.getObstacle(other); !obstacle.empty())
      note << obstacle;
    else
      note << llvm::formatv(
                  "{0:F1} times the operations",
                  double(work.getCost(other)) /
                      double(std::max<int64_t>(1, work.getCost(chosen))))
                  .str();
  }
}

/// Says at `at`, which asks for a mapping, what it could have asked for.
static void reportImpossible(const LaneWork &work, Operation *at, StageOp stage,
                             LaneMapping said) {
  std::string possible;
  SmallVector<StringRef> names;
  for (LaneMapping mapping : allMappings)
    if (work.isPossible(mapping))
      names.push_back(stringifyLaneMapping(mapping));
  for (auto [index, name] : llvm::enumerate(names)) {
    if (index)
      possible += index + 1 == names.size() ? " or " : ", ";
    possible += ("'" + name + "'").str();
  }
  InFlightDiagnostic error = emitError(at->getLoc())
                             << "expected lanes of stage '" << getCppName(stage)
                             << "' to be given " << possible << ", but got '"
                             << stringifyLaneMapping(said)
                             << "': " << work.getObstacle(said);
  Operation *why = work.unknown ? work.unknown : nullptr;
  if (!why && !work.loops.empty())
    why =
        said == LaneMapping::Collapsed && work.loops.size() == 1 && work.effect
            ? work.effect
            : work.loops.back().loop;
  if (why)
    error.attachNote(why->getLoc()) << "see here";
}

LogicalResult MapLanesPass::map(WorkOpInterface op) {
  LaneWork work(op);
  StageOp stage = getKernelStage(op);
  auto items = dyn_cast<ItemsOp>(*op);
  bool isSource = items && items.getSource();
  ScheduleOp schedule = stage.getSchedule();
  // What work says by itself, then what the stage says.
  Operation *at = op.getOperation();
  std::optional<LaneMapping> said = op.getLanes();
  // What is checked is done in order, whatever the user would like to try.
  if (!said && schedule && !isSource && !work.unknown) {
    at = schedule;
    said = schedule.getLanes();
  }
  // A loop that does nothing may have been removed: no fault of the user's.
  bool needsLoop =
      said == LaneMapping::Iterations || said == LaneMapping::Collapsed;
  if (needsLoop && at == schedule && work.loops.empty()) {
    emitWarning(at->getLoc())
        << "lanes of stage '" << getCppName(stage) << "' are not given '"
        << stringifyLaneMapping(*said)
        << "': there is no parallel loop that does anything";
    said = std::nullopt;
  }
  if (said && !work.isPossible(*said)) {
    reportImpossible(work, at, stage, *said);
    return failure();
  }
  LaneMapping chosen = said.value_or(work.getBest());
  op.setLanes(chosen);
  if (!isSource)
    remark(work, stage, chosen, said.has_value());
  return success();
}

void MapLanesPass::runOnOperation() {
  WalkResult result = getOperation().walk([&](WorkOpInterface work) {
    return failed(map(work)) ? WalkResult::interrupt() : WalkResult::advance();
  });
  if (result.wasInterrupted())
    signalPassFailure();
}
