// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Reciprocals and square roots by approximations.

#include "Piko/Dialect/Piko/IR/PikoApproximation.h"

#include "mlir/IR/TypeUtilities.h"

using namespace mlir;
using namespace piko;

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoApproximationOps.cpp.inc"

/// No processor has them for other numbers.
static LogicalResult verifyApproximation(Operation *op) {
  Type type = op->getResult(0).getType();
  if (getElementTypeOrSelf(type).isF32())
    return success();
  return op->emitOpError("expected f32 or a vector of it, but got ") << type;
}

LogicalResult ApproximateReciprocalOp::verify() {
  return verifyApproximation(*this);
}

LogicalResult ApproximateRsqrtOp::verify() {
  return verifyApproximation(*this);
}

LogicalResult ApproximateSqrtOp::verify() { return verifyApproximation(*this); }
