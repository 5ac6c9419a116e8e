// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages and their phases.

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Piko.h"

#include "StageUses.h"

using namespace mlir;
using namespace piko;

template <typename PhaseOp> static PhaseOp getPhase(StageOp stage) {
  for (auto phase : stage.getOps<PhaseOp>())
    return phase;
  return {};
}

AssignOp StageOp::getAssign() { return getPhase<AssignOp>(*this); }
ScheduleOp StageOp::getSchedule() { return getPhase<ScheduleOp>(*this); }
ProcessOp StageOp::getProcess() { return getPhase<ProcessOp>(*this); }

bool StageOp::isWholeDomain() {
  return llvm::all_of(getBins(), [](int64_t extent) { return extent == 0; });
}

Type StageOp::getProcessType() {
  if (getTakesList())
    return ListType::get(getContext(), getInputAttr());
  return PrimType::get(getContext(), getInputAttr());
}

bool StageOp::collects() {
  ScheduleOp schedule = getSchedule();
  return getTakesList() ||
         (schedule &&
          (schedule.getEndBin() || (schedule.getEndStageAttr() &&
                                    !schedule.getEndStageAttr().empty())));
}

LogicalResult StageOp::verifySymbolUses(SymbolTableCollection &) {
  for (auto other : getPipeline(*this).getOps<StageOp>())
    if (getLabel() && other != *this && getCppName(other) == *getLabel())
      return emitOpError("expected a label that no other stage has, but got '")
             << *getLabel() << "'";
  SmallVector<FlatSymbolRefAttr> records{getInputAttr()};
  llvm::append_range(records, getOutputs().getAsRange<FlatSymbolRefAttr>());
  for (FlatSymbolRefAttr record : records)
    if (!lookupRecord(*this, record))
      return emitOpError("expected a record, but got ")
             << record << ", which is none";
  return success();
}

LogicalResult StageOp::verifyRegions() {
  if (int64_t(getBins().size()) != getPipeline(*this).getRank())
    return emitOpError("expected bins of the pipeline's rank, ")
           << getPipeline(*this).getRank() << ", but got " << getBins().size()
           << " extents";
  for (int64_t extent : getBins())
    if (extent < 0)
      return emitOpError("expected bin extents of at least 0, but got ")
             << extent;
  int count[3] = {0, 0, 0};
  for (Operation &op : *getBodyBlock()) {
    int kind = isa<AssignOp>(op)     ? 0
               : isa<ScheduleOp>(op) ? 1
               : isa<ProcessOp>(op)  ? 2
                                     : 3;
    if (kind == 3)
      return op.emitOpError("expected only phases in a stage");
    if (++count[kind] == 2)
      return op.emitOpError("expected at most one phase of a kind in stage '")
             << getCppName(*this) << "'";
  }
  // Below the authored level the phases are in kernels.
  if (!count[2])
    return count[0] ? emitOpError("expected a process phase") : success();
  if (!count[0] && !isWholeDomain())
    return emitOpError("expected an assign phase, because one bin is not the "
                       "whole domain");
  return success();
}

LogicalResult ScheduleOp::verifySymbolUses(SymbolTableCollection &) {
  if (getTileSplit() && getKind() != ScheduleKind::All)
    return emitOpError("expected tile_split only with 'all', but got '")
           << stringifyScheduleKind(getKind()) << "'";
  auto owner = cast<StageOp>((*this)->getParentOp());
  if ((getBatch() || getEveryBin()) && !owner.getTakesList())
    return emitOpError("expected ")
           << (getBatch() ? "batch" : "every_bin")
           << " only in a stage that takes a list, but '" << getCppName(owner)
           << "' does not";
  if (!getEndStageAttr())
    return success();
  for (auto name : getEndStageAttr().getAsRange<FlatSymbolRefAttr>()) {
    auto stage = lookupInPipeline<StageOp>(*this, name);
    if (!stage)
      return emitOpError("expected a stage to wait for, but got ")
             << name << ", which is none";
    if (stage == (*this)->getParentOp())
      return emitOpError("expected a stage to wait for another, but ")
             << name << " waits for itself";
  }
  return success();
}

/// Whether an operation does nothing but to arrays of a call's own.
static bool isPrivate(Operation *op) {
  auto effects = dyn_cast<MemoryEffectOpInterface>(op);
  if (!effects)
    return false;
  SmallVector<MemoryEffects::EffectInstance> found;
  effects.getEffects(found);
  return llvm::all_of(found, [](const MemoryEffects::EffectInstance &effect) {
    return effect.getValue() && isa<MemRefType>(effect.getValue().getType());
  });
}

/// Whether passes can know what an operation of a phase does.
static bool isKnown(Operation *op) {
  return isa<PikoDialect>(op->getDialect()) ||
         isa<AssignmentOpInterface, EmissionOpInterface, StateAccessOpInterface,
             BarrierOpInterface, ParallelLoopOpInterface>(op) ||
         op->hasTrait<OpTrait::HasRecursiveMemoryEffects>() ||
         op->hasTrait<OpTrait::IsTerminator>() || isPrivate(op);
}

/// The dialects of memory and functions may be unknown here, so that their
/// operations are told by name.
static LogicalResult verifyInPhase(Operation *op) {
  StringRef name = op->getName().getStringRef();
  if (name == "func.call" || name == "func.call_indirect")
    return op->emitError("expected the body of the function in its place, "
                         "because a phase cannot call functions");
  // It would be on the heap, for each primitive.
  if (name == "memref.alloc" || name == "memref.realloc")
    return op->emitError("expected a private array, which is a memref.alloca "
                         "of constant size, but got ")
           << name;
  // Its size would have to be found anew, and stack taken, for each primitive.
  if (name == "memref.alloca" && op->getNumOperands() != 0)
    return op->emitError("expected a private array of constant size");
  if (!isKnown(op))
    return op->emitError("expected an operation that says what it does, but '")
           << name
           << "' may have any effect; let it have those of MLIR's interface, "
              "or "
              "one of the piko dialect's interfaces";
  return success();
}

/// The reference gives assign and schedule phases the state as it is.
static LogicalResult verifyMayAccess(StateAccessOpInterface access) {
  if (access.getAccessKinds() != StateAccess::reads &&
      (access->getParentOfType<AssignOp>() ||
       access->getParentOfType<ScheduleOp>()))
    return access->emitOpError("expected to be inside a process phase, because "
                               "only process phases may change state");
  return success();
}

LogicalResult piko::verifyPhaseBody(Operation *phase) {
  WalkResult result = phase->walk([&](Operation *op) -> WalkResult {
    if (op == phase)
      return WalkResult::advance();
    auto access = dyn_cast<StateAccessOpInterface>(op);
    if (access && failed(verifyMayAccess(access)))
      return WalkResult::interrupt();
    return verifyInPhase(op);
  });
  return failure(result.wasInterrupted());
}

LogicalResult ScheduleOp::verifyRegions() {
  if (getBody().empty())
    return success();
  if (getResolved())
    return emitOpError("expected one that is resolved to have no dynamic body");
  Block &body = getBody().front();
  if (body.getNumArguments() != 1 || !body.getArgument(0).getType().isIndex())
    return emitOpError("expected one block argument of type 'index'");
  if (!isa<ReturnOp>(body.getTerminator()))
    return emitOpError("expected its body to end with piko.return");
  if (failed(verifyPhaseBody(*this)))
    return failure();
  // It runs before the pipeline does.
  WalkResult result = walk([&](StateAccessOpInterface read) {
    if (lookupInPipeline<ConstantOp>(read, read.getAccessedState()))
      return WalkResult::advance();
    read->emitOpError("expected a schedule to read constants only, but got ")
        << read.getAccessedState();
    return WalkResult::interrupt();
  });
  return failure(result.wasInterrupted());
}

static LogicalResult verifyInSchedule(Operation *op, bool needsList) {
  auto schedule = op->getParentOfType<ScheduleOp>();
  if (!schedule)
    return op->emitOpError("expected to be inside a dynamic schedule");
  auto stage = cast<StageOp>(schedule->getParentOp());
  if (needsList && !stage.getTakesList())
    return op->emitOpError("expected to be in a stage that takes a list, but '")
           << getCppName(stage) << "' does not";
  return success();
}

LogicalResult SetScheduleOp::verify() { return verifyInSchedule(*this, false); }
LogicalResult SetBatchOp::verify() { return verifyInSchedule(*this, true); }
LogicalResult SetEveryBinOp::verify() { return verifyInSchedule(*this, true); }

/// A phase outside a stage names its stage; inside one, that one is meant.
template <typename PhaseOp>
static LogicalResult verifyPhase(PhaseOp phase, bool isProcess) {
  Operation *parent = phase->getParentOp();
  if (isa<StageOp>(parent) == bool(phase.getStageAttr()))
    return phase.emitOpError(
        "expected the stage's name inside a kernel, and only there");
  StageOp stage = getPhaseStage(phase);
  if (!stage)
    return phase.emitOpError("expected a stage, but got ")
           << phase.getStageAttr() << ", which is none";
  Block &body = phase.getBody().front();
  Type expected = isProcess
                      ? stage.getProcessType()
                      : PrimType::get(phase.getContext(), stage.getInputAttr());
  if (body.getNumArguments() != 1 || body.getArgument(0).getType() != expected)
    return phase.emitOpError("expected one block argument of type ")
           << expected;
  return verifyPhaseBody(phase);
}

LogicalResult piko::verifySource(Operation *op, std::optional<int64_t> number,
                                 FlatSymbolRefAttr stage) {
  if (!number)
    return success();
  int64_t next = 0;
  for (auto source : getPipeline(op).getOps<SourceOp>())
    if (next++ == *number && source.getStageAttr() == stage)
      return success();
  return op->emitOpError("expected the number of a source of ")
         << stage << ", but got " << *number;
}

LogicalResult AssignOp::verifyRegions() {
  if (isa<StageOp>((*this)->getParentOp())
          ? getPort() || getSource()
          : getPort().has_value() == getSource().has_value())
    return emitOpError("expected a port or a source inside a kernel, and "
                       "neither inside a stage");
  if (failed(verifyPhase(*this, /*isProcess=*/false)))
    return failure();
  return verifySource(*this, getSource(), getStageAttr());
}

LogicalResult ProcessOp::verifyRegions() {
  if (getPrecision() && !isa<StageOp>((*this)->getParentOp()))
    return emitOpError("expected a precision only in a piko.stage");
  return verifyPhase(*this, /*isProcess=*/true);
}
