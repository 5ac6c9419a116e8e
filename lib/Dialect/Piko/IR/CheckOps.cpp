// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What checking mode adds to a pipeline.

#include "Piko/Dialect/Piko/IR/PikoCheck.h"

using namespace mlir;
using namespace piko;

#include "Piko/Dialect/Piko/IR/PikoCheckEnums.cpp.inc"

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoCheckOps.cpp.inc"

LogicalResult CheckRecordOp::verifySymbolUses(SymbolTableCollection &) {
  for (FlatSymbolRefAttr name : {getRecordAttr(), getHostAttr()})
    if (!lookupRecord(*this, name))
      return emitOpError("expected a record, but got ")
             << name << ", which is none";
  if (!lookupRecord(*this, getRecordAttr()).getField(lineageField))
    return emitOpError("expected ")
           << getRecordAttr() << " to have a field '" << lineageField << "'";
  return success();
}

LogicalResult CheckAccessOp::verifySymbolUses(SymbolTableCollection &) {
  auto *state = lookupInPipeline<Operation *>(*this, getStateAttr());
  if (!isa_and_nonnull<BufferOp, ImageOp>(state))
    return emitOpError("expected a buffer or an image, but got ")
           << getStateAttr() << ", which is none";
  if (int64_t(getIndices().size()) != getStateRank(state))
    return emitOpError("expected ")
           << getStateRank(state) << " indices into " << getStateAttr()
           << ", but got " << getIndices().size();
  return success();
}

LogicalResult CheckLoopOp::verify() {
  bool needed = getEvent() == CheckedLoop::Iteration ||
                getEvent() == CheckedLoop::Barrier;
  if (needed != bool(getIteration()))
    return emitOpError("expected ")
           << (needed ? "an" : "no") << " iteration with '"
           << stringifyCheckedLoop(getEvent()) << "'";
  return success();
}
