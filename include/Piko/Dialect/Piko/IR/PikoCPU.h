// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The operations that the CPU's lowering makes of kernels.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOCPU_H
#define PIKO_DIALECT_PIKO_IR_PIKOCPU_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {
/// How many loops of a kernel may be held in two versions
/// (`piko.cpu.takes_vectors`), as the runtime has it.
constexpr int64_t mostMappings = 16;
} // namespace piko

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoCPUOps.h.inc"

#endif // PIKO_DIALECT_PIKO_IR_PIKOCPU_H
