// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a pipeline takes for granted of what the host gives it.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOFIXED_H
#define PIKO_DIALECT_PIKO_IR_PIKOFIXED_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoFixedOps.h.inc"

#endif // PIKO_DIALECT_PIKO_IR_PIKOFIXED_H
