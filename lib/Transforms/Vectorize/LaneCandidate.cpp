// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A loop becomes vectors where its schedule says so, or where these are surely
// faster than scalar code, by the estimates of Vectorize/Cost. Scalar code is
//
//   * for a row of a box, which mostly has few pixels, what the row takes, and
//     not what as many iterations as there are lanes would;
//   * for primitives with a loop along a buffer, what LLVM makes of that loop,
//     vectors along it (LoopStreams);
//   * for primitives with loops that iterate equally often for all of them, as
//     over the rows of an image, those loops as vectors.
//
// Where the dependences between iterations of inner loops take longer than
// their operations, primitives, and loops in order, have two vectors of 16
// lanes, of which one is under way while the other one waits (LaneLatency).
//
// With a window, estimates within that factor of each other leave the choice to
// the runtime; within less of it where bodies are large, or rows of boxes.

#include "Vectorize/LaneCandidate.h"

#include "Vectorize/Analysis/Lanes.h"
#include "Vectorize/Analysis/LoopStreams.h"
#include "Vectorize/Cost/LaneCycles.h"
#include "Vectorize/Cost/LaneLatency.h"
#include "Vectorize/Shape/SequentialLoops.h"

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "llvm/ADT/MapVector.h"
#include "llvm/Support/FormatVariadic.h"

#include <cmath>

using namespace mlir;
using namespace piko;

/// Whether lanes of a loop over primitives could be given something else than
/// piko-map-lanes has said, which has only estimated.
static bool isOpen(scf::ForOp loop) {
  StageOp stage = getKernelStage(loop);
  ScheduleOp schedule = stage ? stage.getSchedule() : ScheduleOp();
  return getLaneMapping(loop) != LaneMapping::One &&
         !(schedule && schedule.getLanes());
}

LaneCandidate::LaneCandidate(scf::ForOp loop, double window)
    : loop(loop), ofPrimitives(isOverPrimitives(loop)), window(window) {
  using Lanes = LaneMapping;
  Lanes lanes = ofPrimitives ? Lanes::Items : Lanes::Iterations;
  if (ofPrimitives) {
    preferred = getLaneMapping(loop).value_or(lanes) == lanes;
    chosen = preferred || (window > 1 && isOpen(loop));
  } else {
    std::optional<Lanes> given; // of the primitives around it
    chosen = true;
    for (Operation *at = loop->getParentOp(); at; at = at->getParentOp())
      if (auto outer = dyn_cast<scf::ForOp>(at))
        if (std::optional<Lanes> its = getLaneMapping(outer)) {
          given = its;
          chosen &= *its == lanes || *its == Lanes::Collapsed;
        }
    if (!given) // a call that takes a list
      chosen = !hasSpecifiedLanes(loop, Lanes::One) || findBarrier(loop);
  }
  said =
      findBarrier(loop) || (hasSpecifiedLanes(loop, lanes) &&
                            (!ofPrimitives || getLoopPhase(loop) == "process"));
}

InFlightDiagnostic piko::remarkStage(Operation *loop) {
  InFlightDiagnostic remark = loop->emitRemark();
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

/// What an access reads or writes, as the text names it.
static std::string describeAccessed(Operation *op) {
  if (auto access = dyn_cast<StateAccessOpInterface>(op))
    return ("'" + access.getAccessedState().getValue() + "'").str();
  return "an array";
}

/// Whether lanes come to an operation only where a vote has failed.
static bool standsAfterVote(Operation *op) {
  for (Region *region = op->getParentRegion(); region;
       region = region->getParentRegion()) {
    auto choice = dyn_cast<scf::IfOp>(region->getParentOp());
    if (choice && region == &choice.getElseRegion() &&
        choice.getCondition().getDefiningOp<VoteOp>())
      return true;
  }
  return false;
}

/// Where lanes access elements in different places, by line, and what share of
/// the estimate that is; but for primitives, which are where they are.
static void addGathers(InFlightDiagnostic &remark, const IterationLanes &lanes,
                       const IterationLanes::Cost &cost) {
  constexpr size_t most = 4;
  constexpr double least = 0.1;
  struct Line {
    double cycles = 0;
    Operation *first = nullptr;
    int64_t count = 0;
  };
  llvm::MapVector<Location, Line> lines;
  for (auto [part, op] : cost.obstacles)
    if (lanes.getForm(op) == LaneForm::Access && !isa<GetOp, ItemOp>(op) &&
        !standsAfterVote(op)) {
      Line &line = lines[op->getLoc()];
      line.cycles += part;
      line.first = op;
      ++line.count;
    }
  auto sorted = lines.takeVector();
  llvm::stable_sort(sorted, [](const auto &a, const auto &b) {
    return a.second.cycles > b.second.cycles;
  });
  size_t told = 0;
  for (const auto &[where, line] : sorted) {
    double share = line.cycles / cost.vectors;
    if (told++ == most || share < least)
      return;
    bool writes = isa<StoreOp, memref::StoreOp>(line.first);
    bool isStrided = lanes.isRow(line.first);
    Diagnostic &note = remark.attachNote(where);
    note << "lanes " << (writes ? "write " : "read ")
         << (isStrided ? "a field of " : "") << describeAccessed(line.first)
         << (isStrided ? " one after the other, by "
                       : " in different places, by ")
         << (line.count > 1 ? std::to_string(line.count) + " " : "a ")
         << (writes ? "scatter" : "gather") << (line.count > 1 ? "s" : "")
         << ": about " << std::llround(100 * share) << " % of the estimate";
    if (told == 1)
      note << (isStrided ? "; in a buffer of its own the field is a row"
                         : "; where the index is the number of the iteration, "
                           "and what all lanes share, it is a row");
  }
}

/// How many tests of indices an iteration has, and of what.
static void addTests(InFlightDiagnostic &remark, const IterationLanes &lanes) {
  llvm::MapVector<StringRef, int64_t> tests;
  scf::ForOp loop = lanes.getLoop();
  loop.walk([&](FailOp fail) { ++tests[fail.getState()]; });
  if (tests.empty())
    return;
  Diagnostic &note = remark.attachNote(loop.getLoc());
  note << "indices are tested when the pipeline runs:";
  StringRef separator = " ";
  for (auto [state, count] : tests) {
    note << separator << "'" << state << "'";
    if (count > 1)
      note << " " << count << " times";
    separator = ", ";
  }
  note << "; --fix=NAME.size=N, or an index that is less by & or %, proves "
          "them";
}

/// A tie goes to the simpler code. With half the lanes estimates matter more:
/// measured, bodies that are expected to gain less than a fifth lose.
bool piko::isSurelyFaster(const IterationLanes::Cost &cost, int64_t laneCount) {
  constexpr double tie = 0.98, sure = 0.8;
  return cost.vectors < (laneCount == 8 ? sure : tie) * cost.serial;
}

/// Only loops that iterate as often for all primitives count, as those over the
/// rows of an image: others may be short.
double LaneCandidate::getCostInside(const IterationLanes &lanes,
                                    const IterationLanes::Cost &cost) {
  double inside = cost.serial;
  scf::ForOp root = lanes.getLoop();
  root->walk<WalkOrder::PreOrder>([&](scf::ForOp inner) {
    if (inner == root || !lanes.isSharedLoop(inner) ||
        isFallback(*inner->getParentRegion()) ||
        !mayRunInOrder(inner, lanes.getLaneCount()))
      return WalkResult::advance();
    IterationLanes iterations(inner, lanes.getLaneCount());
    IterationLanes::Cost part = iterations.getCost();
    if (iterations.getRefusal().at || !part.computes ||
        !isSurelyFaster(part, lanes.getLaneCount()))
      return WalkResult::advance();
    inside -= cost.loops.lookup(inner) * (1 - part.vectors / part.serial);
    return WalkResult::skip();
  });
  return inside;
}

double LaneCandidate::getScalarCost(const IterationLanes &lanes,
                                    const IterationLanes::Cost &cost,
                                    const Cycles &cycles) {
  if (ofPrimitives)
    return getCostInside(lanes, cost);
  // LLVM makes its own vectors of straight loops, without masks.
  double along = hasVectorsAlong(loop) ? cycles.along : 1;
  return (isOverBox(loop) ? cycles.boxRow : 1) * cost.serial / along;
}

LaneCandidate::Versions LaneCandidate::estimate(const IterationLanes &lanes,
                                                const FlatLoop &flat,
                                                const Cycles &cycles) {
  IterationLanes::Cost cost = lanes.getCost(cycles);
  double vectors = flat.loop ? IterationLanes(flat.loop, lanes.getLaneCount())
                                   .getCost(cycles)
                                   .vectors
                             : cost.vectors;
  return {vectors * cost.weighVectors(),
          getScalarCost(lanes, cost, cycles) * cost.weighSerial(),
          /*expected=*/false};
}

LaneCandidate::Refusal LaneCandidate::findRefusal(const IterationLanes &lanes,
                                                  const FlatLoop &flat) {
  if (!preferred)
    return {"lanes are expected to do more with iterations of a loop in it"};
  IterationLanes::Cost cost = lanes.getCost();
  double ofVectors = cost.weighVectors(), ofSerial = cost.weighSerial();
  double inside = ofPrimitives ? getCostInside(lanes, cost) * ofSerial : 0;
  cost.vectors *= ofVectors;
  cost.serial *= ofSerial;
  if (!ofPrimitives && isOverBox(loop) &&
      cost.vectors >
          getScalarCost(lanes, cost, getCycles(lanes.getLaneCount())))
    return {"a box may have few pixels"};
  bool isFaster = ofPrimitives ? isSurelyFaster(cost, lanes.getLaneCount())
                               : cost.isWorthwhile();
  // Flattened nests make up for little else that was not foreseen.
  constexpr double half = 0.5;
  bool isFasterFlat = flat.loop && cost.isWorthwhile() &&
                      flat.cost.vectors * ofVectors < half * cost.serial;
  if (!isFaster && !isFasterFlat) {
    std::string text =
        llvm::formatv("{0} at once are expected to take {1:f0} "
                      "cycles, and one after the other {2:f0}",
                      lanes.getLaneCount(), cost.vectors, cost.serial);
    if (cost.vectors < cost.serial)
      text += ", which is not surely more";
    return {text, /*byCycles=*/true};
  }
  constexpr double gain = 0.98; // Or primitives are simpler.
  bool isFasterInside = ofPrimitives && inside < gain * cost.vectors;
  return {isFasterInside ? "iterations of a loop in it are" : ""};
}

double LaneCandidate::getShareOfWindow(bool isRefused) {
  int64_t operations = countOperations(loop);
  // What is held in vain takes a compiler's time, vectors more than others: a
  // rasterizer's whole body, of 1,300 operations, half of what all took.
  double many = isRefused ? 400 : 1200;
  constexpr int64_t most = 1000;
  if (isRefused && operations > most)
    return 0;
  // What is known of boxes is in their estimates already: few are large.
  double ofKind = !ofPrimitives && isOverBox(loop) ? 1.0 / 3 : 1;
  return ofKind * std::min(1.0, many / double(operations));
}

bool LaneCandidate::isDoubtful(const IterationLanes &lanes,
                               const FlatLoop &flat, bool isRefused) {
  Versions found = estimate(lanes, flat, getCycles(lanes.getLaneCount()));
  double share = getShareOfWindow(isRefused);
  if (share == 0)
    return false;
  double near = std::pow(window, share);
  if (found.vectors > near * found.scalar ||
      (!isRefused && near * found.vectors < found.scalar))
    return false;
  found.expected = !isRefused;
  versions = found;
  return true;
}

/// A row of pixels, or a bin's, may fill no more than one vector.
bool LaneCandidate::paysInPairs(const IterationLanes &lanes,
                                const FlatLoop &flat) const {
  if (!ofPrimitives || lanes.getLaneCount() != widestLanes || asksAhead(loop))
    return false;
  if (flat.isMerged) // Its state fills the registers.
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
    remark.attachNote(nest)
        << "lanes go on in this loop each by itself, "
        << (flat.isMerged ? "and do what is around the loop inside when enough "
                            "of them are done with that"
                          : "however often the loop inside iterates");
  for (Location nest : flat.ordered)
    remark.attachNote(nest) << "lanes take turns to go through this loop, "
                               "because an order shows of what it does";
  if (versions)
    remark << ", and held one after the other as well, to measure which is "
              "faster: "
           << std::llround(versions->vectors) << " cycles are expected, and "
           << std::llround(versions->scalar);
  IterationLanes::Cost cost = lanes.getCost();
  addObstacles(remark, lanes, cost, /*isRefused=*/false);
  addGathers(remark, lanes, cost);
  addTests(remark, lanes);
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
  Refusal refusal = said ? Refusal() : findRefusal(lanes, flat);
  bool mayHoldBoth = window > 1 && !said && isOpen(loop);
  if (!(mayHoldBoth && isDoubtful(lanes, flat, !refusal.why.empty())) &&
      !refusal.why.empty()) {
    InFlightDiagnostic remark = refuse()
                                << refusal.why << "; specifyLanes("
                                << (ofPrimitives ? "Items" : "Iterations")
                                << ") does so all the same";
    if (refusal.byCycles)
      addObstacles(remark, lanes, cost, /*isRefused=*/true);
    return false;
  }
  paired = paysInPairs(lanes, flat);
  remarkVectors(lanes, flat);
  return true;
}
