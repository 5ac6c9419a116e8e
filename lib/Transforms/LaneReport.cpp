// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "LaneReport.h"
#include "LaneWriter.h"
#include "StateAccess.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;

StringRef piko::getLoopPhase(scf::ForOp loop) {
  for (ItemOp item : loop.getBody()->getOps<ItemOp>())
    if (auto bins = item.getBins().getDefiningOp<OpenBinsOp>())
      return bins.getSource() ? "assignBin" : "process";
  return "process";
}

//===----------------------------------------------------------------------===//
// Obstacles
//===----------------------------------------------------------------------===//

/// What a loop holds that is in the way, as the end of a sentence about it.
static std::string describeInner(Operation *op, const LanePlanner &planner) {
  if (auto [state, kind] = getStateAccess(op); state) {
    std::string name = ("'" + state.getValue() + "'").str();
    if (kind == StateAccess::reads)
      return "it reads " + name +
             (planner.readsFixedState(op) ? " at an index that it computes"
                                          : ", which its kernel writes");
    if (kind == StateAccess::stores)
      return "it stores to " + name;
    return kind == StateAccess::updates ? "it updates " + name
                                        : "it changes " + name + " atomically";
  }
  return llvm::TypeSwitch<Operation *, std::string>(op)
      .Case<AppendOp, AppendBinOp>([](auto) { return "it emits"; })
      .Case(
          [](GetOp) { return "it reads a field at an index that it computes"; })
      .Case<memref::AllocaOp, memref::LoadOp, memref::StoreOp>(
          [](auto) { return "it uses a local array"; })
      .Case([](scf::ForOp) { return "it holds a parallelFor"; })
      .Case<DivideOp, arith::DivSIOp, arith::DivUIOp, arith::RemSIOp,
            arith::RemUIOp>(
          [](auto) { return "it divides integers, perhaps by 0"; })
      .Default([](Operation *other) {
        return "it holds '" + other->getName().getStringRef().str() +
               "', which has no vector form";
      });
}

/// What is in the way by itself, and why.
static std::string describe(Operation *op, const LanePlanner &planner) {
  const std::string isNot = " is not vectorized";
  if (auto [state, kind] = getStateAccess(op); state) {
    std::string name = ("'" + state.getValue() + "'").str();
    if (kind == StateAccess::reads)
      return "this read of " + name + isNot +
             (planner.readsFixedState(op) ? ": its index is computed"
                                          : ": its kernel writes " + name);
    return (kind == StateAccess::updates ? "this update of " + name
                                         : "this change of " + name) +
           isNot + ", nor is what needs its result";
  }
  return llvm::TypeSwitch<Operation *, std::string>(op)
      .Case([&](GetOp) {
        return "this read of a field" + isNot + ": its index is computed";
      })
      .Case<memref::AllocaOp, memref::LoadOp, memref::StoreOp>(
          [&](auto) { return "this use of a local array" + isNot; })
      .Case([&](scf::ForOp) {
        return "this parallelFor" + isNot +
               ": its iterations are left to piko-vectorize-iterations";
      })
      .Case<DivideOp, arith::DivSIOp, arith::DivUIOp, arith::RemSIOp,
            arith::RemUIOp>([&](auto) {
        return "this division of integers" + isNot + ": it may be by 0";
      })
      .Default([&](Operation *other) {
        return "'" + other->getName().getStringRef().str() + "'" + isNot +
               ": it has no vector form";
      });
}

static std::string describe(const LaneObstacle &obstacle,
                            const LanePlanner &planner) {
  const std::string start = "this loop is not vectorized: ";
  switch (obstacle.reason) {
  case LaneObstacle::isItself:
    return describe(obstacle.op, planner);
  case LaneObstacle::holds:
    return start + describeInner(obstacle.inner, planner);
  case LaneObstacle::carries:
    return start + "what it carries is no number";
  case LaneObstacle::differs:
    return start + "its number of iterations differs between primitives";
  case LaneObstacle::isEntered:
    return start + "only some primitives enter it";
  }
  llvm_unreachable("all reasons are above");
}

/// The line that shows an obstacle. The place of an array is not that of its
/// declaration.
static Location locate(Operation *op, scf::ForOp loop) {
  if (isa<memref::AllocaOp>(op))
    for (Operation *user : llvm::reverse(llvm::to_vector(op->getUsers())))
      if (loop->isAncestor(user))
        return user->getLoc();
  return op->getLoc();
}

void LaneReport::addNote(Verdict &verdict, const LaneObstacle &obstacle,
                         const LanePlanner &planner) {
  std::string text = describe(obstacle, planner);
  Location location = locate(obstacle.op, planner.getLoop());
  for (const Note &note : verdict.notes)
    if (note.location == location && note.text == text)
      return;
  verdict.notes.push_back({location, text});
}

//===----------------------------------------------------------------------===//
// Verdicts
//===----------------------------------------------------------------------===//

LaneReport::LaneReport(PipelineOp pipeline) {
  SmallVector<scf::ForOp> loops = findLoopsOverPrimitives(pipeline);
  pipeline.walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (auto list = dyn_cast<ListOp>(op))
      add(list);
    else if (auto loop = dyn_cast<scf::ForOp>(op);
             loop && llvm::is_contained(loops, loop))
      getVerdict(loop, getLoopPhase(loop));
  });
}

LaneReport::Verdict &LaneReport::getVerdict(Operation *op, StringRef phase) {
  StageOp stage = getKernelStage(op);
  auto [place, isNew] =
      verdicts.try_emplace({stage, phase}, Verdict{stage, phase, op->getLoc()});
  return place->second;
}

void LaneReport::add(scf::ForOp loop, const LanePlanner &planner, LaneCost cost,
                     bool isVectorized) {
  Verdict &verdict = getVerdict(loop, getLoopPhase(loop));
  bool isBehindTest = loop->hasAttr(marks::passed);
  ++verdict.loops;
  verdict.vectorized += isVectorized;
  verdict.isBehindTest |= isVectorized && isBehindTest;
  verdict.lanes = getLaneMapping(loop);
  if (verdict.lanes == LaneMapping::One)
    return;
  std::string text = isBehindTest ? "behind this test, " : "";
  text += std::to_string(cost.operations) + " operations " +
          (isVectorized ? "run ahead of effects, and keep "
                        : "could run ahead of effects, and would keep ") +
          std::to_string(cost.values) + " values";
  if (!isVectorized)
    text += ": expected at least " + std::to_string(cost.getLeast()) +
            " operations";
  verdict.notes.push_back({loop.getLoc(), text});
  if (Value other = planner.getOther())
    verdict.notes.push_back(
        {other.getLoc(), "this would have to be kept, but is no number"});
  for (const LaneObstacle &obstacle : planner.getObstacles())
    addNote(verdict, obstacle, planner);
}

void LaneReport::add(ListOp list) {
  Verdict &verdict = getVerdict(list, "process");
  ++verdict.loops;
  verdict.notes.push_back(
      {list.getLoc(), "it takes a list, and runs once for all of it"});
}

/// The stages that run inside of another.
static std::string describeFused(StageOp stage) {
  std::string text;
  if (stage.getFusedAttr())
    for (auto name : stage.getFusedAttr().getAsRange<StringAttr>())
      text += (text.empty() ? " with '" : ", '") + name.str() + "'";
  return text;
}

void LaneReport::emit() const {
  for (const auto &[key, verdict] : verdicts) {
    InFlightDiagnostic remark =
        emitRemark(verdict.location)
        << "stage '" << getCppName(StageOp(verdict.stage)) << "'"
        << describeFused(verdict.stage) << ": " << verdict.phase << " is ";
    if (!verdict.vectorized)
      remark << "not vectorized";
    else
      remark << "vectorized for " << laneCount << " primitives at once";
    if (verdict.vectorized && verdict.vectorized < verdict.loops)
      remark << (verdict.isBehindTest ? " behind a test" : " in part");
    if (verdict.lanes)
      remark << "; lanes are given " << stringifyLaneMapping(*verdict.lanes);
    for (const Note &note : verdict.notes)
      remark.attachNote(note.location) << note.text;
  }
}
