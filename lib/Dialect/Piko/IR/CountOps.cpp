// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What counting adds to a pipeline.

#include "ElementAccess.h"
#include "Piko/Dialect/Piko/IR/PikoCount.h"

using namespace mlir;
using namespace piko;

#include "Piko/Dialect/Piko/IR/PikoCountEnums.cpp.inc"

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoCountOps.cpp.inc"

static bool isAccess(CounterKind kind) {
  return kind == CounterKind::Reads || kind == CounterKind::Stores ||
         kind == CounterKind::Updates || kind == CounterKind::Atomics;
}

LogicalResult CounterOp::verifySymbolUses(SymbolTableCollection &) {
  if (isAccess(getKind()) != bool(getStateAttr()))
    return emitOpError("expected ")
           << (isAccess(getKind()) ? "a" : "no") << " piece of state with '"
           << stringifyCounterKind(getKind()) << "'";
  if ((getKind() == CounterKind::Emissions) != getPort().has_value())
    return emitOpError("expected a port with 'emissions' alone");
  if (getInside() && *getInside() >= getNumber())
    return emitOpError("expected it inside of an earlier counter, but got ")
           << *getInside();
  if (getStateAttr() &&
      !isa_and_nonnull<BufferOp, ImageOp>(
          lookupInPipeline<Operation *>(*this, getStateAttr())))
    return emitOpError("expected a buffer or an image, but got ")
           << getStateAttr() << ", which is none";
  return success();
}

LogicalResult CountElementOp::verifySymbolUses(SymbolTableCollection &) {
  return verifyElement(*this, getStateAttr(), getIndices().size());
}
