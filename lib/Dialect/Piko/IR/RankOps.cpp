// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Statements of a program that several ranks run: who runs what, and what they
// exchange.

#include "StageUses.h"

#include "Piko/Dialect/Piko/IR/PikoProgram.h"

using namespace mlir;
using namespace piko;

#include "Piko/Dialect/Piko/IR/PikoProgramEnums.cpp.inc"

LogicalResult PartitionOp::verify() {
  if (failed(verifyStage(*this, getStageAttr())))
    return failure();
  auto stage = lookupInPipeline<StageOp>(*this, getStageAttr());
  RankDivision division = getDivision();
  if (division == RankDivision::First)
    return emitOpError("expected more than one rank to run a stage");
  if (division == RankDivision::Parts &&
      (!stage.isWholeDomain() || stage.getTakesList()))
    return emitOpError("expected a stage of one bin that takes no list, but "
                       "got ")
           << getStageAttr();
  if (getOwners() && division != RankDivision::Bins)
    return emitOpError("expected owners of bins alone");
  return success();
}

/// Whether a name is that of an image or a buffer.
static LogicalResult verifyMutable(Operation *op, FlatSymbolRefAttr name) {
  if (isa_and_nonnull<ImageOp, BufferOp>(
          lookupInPipeline<Operation *>(op, name)))
    return success();
  return op->emitOpError("expected an image or a buffer, but got ")
         << name << ", which is none";
}

LogicalResult KeepOp::verify() {
  if (failed(verifyMutable(*this, getStateAttr())))
    return failure();
  auto buffer = lookupInPipeline<BufferOp>(*this, getStateAttr());
  if (getCleared() && buffer && !buffer.getPerSource())
    return emitOpError("expected state that a run clears, but got ")
           << getStateAttr();
  return success();
}

LogicalResult CommonOp::verify() {
  if (failed(verifyStage(*this, getStageAttr())))
    return failure();
  if (!lookupInPipeline<ImageOp>(*this, getImageAttr()))
    return emitOpError("expected an image, but got ") << getImageAttr();
  return success();
}

LogicalResult ShareOp::verify() {
  if (failed(verifyMutable(*this, getStateAttr())))
    return failure();
  if (getStageAttr() && failed(verifyStage(*this, getStageAttr())))
    return failure();
  if (getStageAttr() && !lookupInPipeline<ImageOp>(*this, getStateAttr()))
    return emitOpError("expected an image, whose pixels bins own, but got ")
           << getStateAttr();
  if (getToOwners() && (!getStageAttr() || getToFirst()))
    return emitOpError("expected the stage whose bins' owners it goes to");
  if (int(getStageAttr() && !getToOwners()) + getFromFirst() +
          bool(getReduceAttr()) >
      1)
    return emitOpError("expected one way to bring ranks' changes together");
  ArrayAttr reduce = getReduceAttr();
  if (reduce && reduce.size() % 2 != 0)
    return emitOpError("expected a field and an operation for each reduction");
  for (size_t i = 1; reduce && i < reduce.size(); i += 2) {
    auto kind = symbolizeAtomicKind(cast<StringAttr>(reduce[i]).getValue());
    if (!kind || *kind == AtomicKind::AddF)
      return emitOpError("expected an operation on integers, but got ")
             << reduce[i];
  }
  return success();
}
