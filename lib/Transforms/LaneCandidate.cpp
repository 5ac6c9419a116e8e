// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "LaneCandidate.h"

#include "LaneLatency.h"
#include "Lanes.h"
#include "SequentialLoops.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include <cmath>

using namespace mlir;
using namespace piko;

LaneCandidate::LaneCandidate(scf::ForOp loop)
    : loop(loop), ofPrimitives(isOverPrimitives(loop)) {
  using Lanes = LaneMapping;
  Lanes lanes = ofPrimitives ? Lanes::Items : Lanes::Iterations;
  if (ofPrimitives) {
    chosen = getLaneMapping(loop).value_or(lanes) == lanes;
  } else {
    chosen = true;
    for (Operation *at = loop->getParentOp(); at; at = at->getParentOp())
      if (auto outer = dyn_cast<scf::ForOp>(at))
        if (std::optional<Lanes> given = getLaneMapping(outer))
          chosen &= *given == lanes || *given == Lanes::Collapsed;
  }
  said =
      findBarrier(loop) || (hasSpecifiedLanes(loop, lanes) &&
                            (!ofPrimitives || getLoopPhase(loop) == "process"));
}

InFlightDiagnostic piko::remarkStage(scf::ForOp loop) {
  InFlightDiagnostic remark = loop.emitRemark();
  if (StageOp stage = getKernelStage(loop))
    remark << "stage '" << stage.getSymName() << "': ";
  return remark;
}

InFlightDiagnostic LaneCandidate::refuse() {
  InFlightDiagnostic remark = remarkStage(loop);
  if (ofPrimitives)
    remark << getLoopPhase(loop) << " is not vectorized: ";
  else
    remark << "these iterations are not vectorized: ";
  return remark;
}

/// What costs most where lanes take turns, at the user's lines; of a loop that
/// is refused also where they are in different places.
static void addObstacles(InFlightDiagnostic &remark,
                         const IterationLanes &lanes,
                         const IterationLanes::Cost &cost, bool isRefused) {
  constexpr size_t most = 2;
  llvm::DenseSet<Location> lines;
  for (auto [part, op] : cost.obstacles) {
    if (lines.size() == most || part < cost.vectors / 8)
      return;
    bool isGather = lanes.getForm(op) == LaneForm::Access;
    if ((isGather && !isRefused) || !lines.insert(op->getLoc()).second)
      continue;
    Diagnostic &note = remark.attachNote(op->getLoc());
    if (isGather)
      note << "lanes access elements in different places";
    else if (isa<AppendOp, AppendBinOp>(op))
      note << "lanes take turns to emit, in order" << lanes.explainTurns(op);
    else if (auto access = dyn_cast<StateAccessOpInterface>(op))
      note << "lanes take turns to access '"
           << access.getAccessedState().getValue() << "'";
    else
      note << "lanes take turns, because this has no vector form";
  }
}

/// With half the lanes estimates matter more: measured, bodies that are
/// expected to gain less than a fifth lose.
bool piko::isSurelyFaster(const IterationLanes::Cost &cost, int64_t laneCount) {
  constexpr double sure = 0.8;
  return cost.vectors < (laneCount == 8 ? sure : 1) * cost.serial;
}

/// Only loops that turn as often for all primitives count, as those over the
/// rows of an image: others may be short.
bool LaneCandidate::isFasterInside(const IterationLanes &lanes,
                                   const IterationLanes::Cost &cost) {
  double inside = cost.serial;
  scf::ForOp root = lanes.getLoop();
  root->walk<WalkOrder::PreOrder>([&](scf::ForOp inner) {
    if (inner == root || !lanes.isSharedLoop(inner) ||
        isFallback(*inner->getParentRegion()) ||
        !mayRunInOrder(inner, lanes.getLaneCount()))
      return WalkResult::advance();
    IterationLanes turns(inner, lanes.getLaneCount());
    IterationLanes::Cost part = turns.getCost();
    if (turns.getRefusal().at || !part.computes ||
        !isSurelyFaster(part, lanes.getLaneCount()))
      return WalkResult::advance();
    inside -= cost.loops.lookup(inner) * (1 - part.vectors / part.serial);
    return WalkResult::skip();
  });
  constexpr double gain = 0.98; // Or primitives are simpler.
  return inside < gain * cost.vectors;
}

bool LaneCandidate::isRefused(const IterationLanes &lanes,
                              const FlatLoop &flat) {
  IterationLanes::Cost cost = lanes.getCost();
  std::string otherwise = "; specifyLanes(";
  otherwise += ofPrimitives ? "Items" : "Iterations";
  otherwise += ") does so all the same";
  if (!ofPrimitives && isOverBox(loop)) {
    refuse() << "a box may have few pixels" << otherwise;
    return true;
  }
  bool isFaster = ofPrimitives ? isSurelyFaster(cost, lanes.getLaneCount())
                               : cost.isWorthwhile();
  // Flattened nests make up for little else that was not foreseen.
  constexpr double half = 0.5;
  bool isFasterFlat = flat.loop && cost.isWorthwhile() &&
                      flat.cost.vectors < half * cost.serial;
  if (!isFaster && !isFasterFlat) {
    InFlightDiagnostic remark = refuse();
    remark << lanes.getLaneCount() << " at once are expected to take "
           << std::llround(cost.vectors) << " cycles, and one after the other "
           << std::llround(cost.serial);
    if (cost.vectors < cost.serial)
      remark << ", which is not surely more";
    remark << otherwise;
    addObstacles(remark, lanes, cost, /*isRefused=*/true);
    return true;
  }
  if (!ofPrimitives || !isFasterInside(lanes, cost))
    return false;
  refuse() << "iterations of a loop in it are" << otherwise;
  return true;
}

/// A row of pixels, or a bin's, may fill no more than one vector.
bool LaneCandidate::paysInPairs(const IterationLanes &lanes,
                                const FlatLoop &flat) const {
  if (!ofPrimitives || lanes.getLaneCount() != widestLanes || asksAhead(loop))
    return false;
  if (!flat.loop)
    return isBoundByLatency(lanes);
  return !isOneVector(flat.loop, widestLanes) &&
         isBoundByLatency(IterationLanes(flat.loop, widestLanes));
}

void LaneCandidate::remarkVectors(const IterationLanes &lanes,
                                  const FlatLoop &flat) {
  InFlightDiagnostic remark = remarkStage(loop);
  if (ofPrimitives)
    remark << getLoopPhase(loop) << " is vectorized for "
           << (paired ? 2 : 1) * lanes.getLaneCount() << " primitives at once";
  else
    remark << "these iterations are vectorized for " << lanes.getLaneCount()
           << " at once";
  for (Location nest : flat.nests)
    remark.attachNote(nest) << "lanes go on in this loop each by itself, "
                               "however often the loop inside turns";
  for (Location nest : flat.ordered)
    remark.attachNote(nest) << "lanes take turns to go through this loop, "
                               "because an order shows of what it does";
  addObstacles(remark, lanes, lanes.getCost(), /*isRefused=*/false);
}

bool LaneCandidate::decide(const IterationLanes &lanes, const FlatLoop &flat) {
  if (const IterationLanes::Refusal &refusal = lanes.getRefusal(); refusal.at) {
    InFlightDiagnostic remark = refuse() << refusal.why;
    if (refusal.at != loop)
      remark.attachNote(refusal.at->getLoc()) << "here";
    return false;
  }
  if (asksAhead(loop))
    return true;
  IterationLanes::Cost cost = lanes.getCost();
  if (!ofPrimitives && !cost.computes)
    return false; // clears or copies, which needs no plan
  if (!said && isRefused(lanes, flat))
    return false;
  paired = paysInPairs(lanes, flat);
  remarkVectors(lanes, flat);
  return true;
}
