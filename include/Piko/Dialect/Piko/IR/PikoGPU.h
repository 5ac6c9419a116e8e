// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The operations that the GPU's lowering makes of kernels.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOGPU_H
#define PIKO_DIALECT_PIKO_IR_PIKOGPU_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoGPUOps.h.inc"

#endif // PIKO_DIALECT_PIKO_IR_PIKOGPU_H
