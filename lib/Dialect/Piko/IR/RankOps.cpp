// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Statements of a program that several ranks run: who runs what, and what they
// exchange.

#include "StageUses.h"

#include "Piko/Dialect/Piko/IR/PikoProgram.h"

using namespace mlir;
using namespace piko;

LogicalResult PartitionOp::verify() {
  if (failed(verifyStage(*this, getStageAttr())))
    return failure();
  auto stage = lookupInPipeline<StageOp>(*this, getStageAttr());
  if (getParts() && (!stage.isWholeDomain() || stage.getTakesList()))
    return emitOpError("expected a stage of one bin that takes no list, but "
                       "got ")
           << getStageAttr();
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

LogicalResult KeepOp::verify() { return verifyMutable(*this, getStateAttr()); }

LogicalResult ShareOp::verify() {
  if (failed(verifyMutable(*this, getStateAttr())))
    return failure();
  if (getStageAttr() && failed(verifyStage(*this, getStageAttr())))
    return failure();
  if (getStageAttr() && !lookupInPipeline<ImageOp>(*this, getStateAttr()))
    return emitOpError("expected an image, whose pixels bins own, but got ")
           << getStateAttr();
  if (int(bool(getStageAttr())) + getFromFirst() + bool(getReduceAttr()) > 1)
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
