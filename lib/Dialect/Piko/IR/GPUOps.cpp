// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The log of a grid, and memory of its blocks.

#include "Piko/Dialect/Piko/IR/PikoGPU.h"

using namespace mlir;
using namespace piko;

LogicalResult DrainOp::verifyRegions() {
  auto hasSize = [](Value array) {
    return cast<MemRefType>(array.getType()).hasStaticShape();
  };
  if (!llvm::all_of(getOperands(), hasSize))
    return emitOpError("expected arrays of constant size");
  if (getClasses().getType().getShape() != getOrder().getType().getShape())
    return emitOpError("expected as many classes as places in the order, but "
                       "got ")
           << getClasses().getType() << " and " << getOrder().getType();
  if (getLengths().getType() != getStarts().getType())
    return emitOpError("expected as many lengths as starts, but got ")
           << getLengths().getType() << " and " << getStarts().getType();
  TypeRange arguments = getBodyBlock()->getArgumentTypes();
  if (arguments.size() != 1 || !arguments.front().isIndex())
    return emitOpError("expected the number of an entry, an index, as the "
                       "body's argument");
  return success();
}

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoGPUOps.cpp.inc"
