// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The operations of counting.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOCOUNT_H
#define PIKO_DIALECT_PIKO_IR_PIKOCOUNT_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "Piko/Dialect/Piko/IR/PikoCountEnums.h.inc"

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoCountOps.h.inc"

#endif // PIKO_DIALECT_PIKO_IR_PIKOCOUNT_H
