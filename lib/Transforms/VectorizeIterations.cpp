// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-vectorize-iterations: the iterations of a parallel loop as lanes.

#include "IterationWriter.h"
#include "LanePlan.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

namespace piko {
#define GEN_PASS_DEF_VECTORIZEITERATIONS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct VectorizeIterationsPass
    : piko::impl::VectorizeIterationsBase<VectorizeIterationsPass> {
  void runOnOperation() override;
};

} // namespace

/// Whether lanes are given the iterations of a loop inside of work.
static bool areLanesGiven(scf::ForOp loop) {
  for (Operation *at = loop->getParentOp(); at; at = at->getParentOp())
    if (auto outer = dyn_cast<scf::ForOp>(at))
      if (std::optional<LaneMapping> mapping = getLaneMapping(outer))
        return *mapping == LaneMapping::Iterations ||
               *mapping == LaneMapping::Collapsed;
  return true;
}

/// Whether the schedule says so, whatever it costs.
static bool isSaid(scf::ForOp loop) {
  StageOp stage = getKernelStage(loop);
  ScheduleOp schedule = stage ? stage.getSchedule() : ScheduleOp();
  return schedule && schedule.getLanes() == LaneMapping::Iterations;
}

/// Whether a loop is over a row of what a bin has of a box. Most boxes are
/// those of small primitives: a rasterizer's loop that was made vectors
/// took 1.05 of its time on a mesh of 70,000 triangles, and 1.37 of the time to
/// compile.
static bool isOverBox(scf::ForOp loop) {
  Value lower = loop.getLowerBound();
  while (auto cast = lower.getDefiningOp<arith::IndexCastOp>())
    lower = cast.getIn();
  return lower.getDefiningOp<arith::MaxSIOp>() != nullptr;
}

/// With fewer iterations the loop runs as it was: a vector takes about as long
/// as this many.
static constexpr int64_t leastIterations = 4;

static void vectorize(const IterationLanes &lanes) {
  scf::ForOp loop = lanes.getLoop();
  Location loc = loop.getLoc();
  OpBuilder builder(loop);
  Type type = loop.getUpperBound().getType();
  Value least = arith::ConstantOp::create(
      builder, loc, builder.getIntegerAttr(type, leastIterations));
  Value count = arith::SubIOp::create(builder, loc, loop.getUpperBound(),
                                      loop.getLowerBound());
  Value isLong = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::sge,
                                       count, least);
  auto choice = scf::IfOp::create(builder, loc, isLong, /*withElse=*/true);
  loop->removeAttr(marks::lanes);
  builder.setInsertionPointToStart(choice.thenBlock());
  IterationWriter(lanes).write(builder.saveInsertionPoint());
  loop->moveBefore(choice.elseBlock(), choice.elseBlock()->begin());
}

/// Whether a loop becomes vectors, which a remark tells.
static bool isVectorized(const IterationLanes &lanes) {
  scf::ForOp loop = lanes.getLoop();
  const std::string isNot = "these iterations are not vectorized: ";
  if (const IterationLanes::Refusal &refusal = lanes.getRefusal(); refusal.at) {
    InFlightDiagnostic remark = loop.emitRemark(isNot) << refusal.why;
    if (refusal.at != loop)
      remark.attachNote(refusal.at->getLoc()) << "here";
    return false;
  }
  IterationLanes::Cost cost = lanes.getCost();
  if (cost.computations == 0)
    return false; // clears or copies, which needs no plan
  if (!isSaid(loop) && isOverBox(loop)) {
    loop.emitRemark(isNot) << "a box may have few pixels; "
                              "specifyLanes(Iterations) does so all the same";
    return false;
  }
  if (!isSaid(loop) && !cost.isWorthwhile()) {
    loop.emitRemark(isNot) << cost.vectors << " operations would be done by "
                           << "vectors, and " << cost.serial
                           << " lane by lane; specifyLanes(Iterations) would "
                              "do so all the same";
    return false;
  }
  loop.emitRemark("these iterations are vectorized for ")
      << laneCount << " at once";
  return true;
}

void VectorizeIterationsPass::runOnOperation() {
  llvm::DenseSet<Operation *> overPrimitives;
  for (scf::ForOp loop : findLoopsOverPrimitives(getOperation()))
    overPrimitives.insert(loop);
  // Loops inside of one that is vectorized are parts of it.
  getOperation().walk<WalkOrder::PreOrder>([&](scf::ForOp loop) {
    if (!loop->hasAttr(marks::lanes) || overPrimitives.contains(loop) ||
        !areLanesGiven(loop))
      return WalkResult::advance();
    IterationLanes lanes(loop);
    if (!isVectorized(lanes)) {
      ++left;
      return WalkResult::advance();
    }
    vectorize(lanes);
    ++vectorized;
    return WalkResult::skip();
  });
}
