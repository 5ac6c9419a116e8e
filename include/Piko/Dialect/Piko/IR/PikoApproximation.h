// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Reciprocals and square roots by the approximations that processors have
// instructions for.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOAPPROXIMATION_H
#define PIKO_DIALECT_PIKO_IR_PIKOAPPROXIMATION_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoApproximationOps.h.inc"

namespace piko {

inline bool isApproximation(mlir::Operation *op) {
  return mlir::isa<ApproximateReciprocalOp, ApproximateRsqrtOp,
                   ApproximateSqrtOp>(op);
}

} // namespace piko

#endif // PIKO_DIALECT_PIKO_IR_PIKOAPPROXIMATION_H
