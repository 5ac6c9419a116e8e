// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The approximations that processors have instructions for.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOAPPROXIMATION_H
#define PIKO_DIALECT_PIKO_IR_PIKOAPPROXIMATION_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoApproximationOps.h.inc"

#endif // PIKO_DIALECT_PIKO_IR_PIKOAPPROXIMATION_H
