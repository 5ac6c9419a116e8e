// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What checking mode adds to a pipeline.

#include "ElementAccess.h"
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
  return verifyElement(*this, getStateAttr(), getIndices().size());
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
