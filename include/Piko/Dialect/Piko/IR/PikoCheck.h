// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The operations of checking mode.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOCHECK_H
#define PIKO_DIALECT_PIKO_IR_PIKOCHECK_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "Piko/Dialect/Piko/IR/PikoCheckEnums.h.inc"

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoCheckOps.h.inc"

namespace piko {

/// The last field of a checked record.
constexpr llvm::StringLiteral lineageField = "piko.lineage";

} // namespace piko

#endif // PIKO_DIALECT_PIKO_IR_PIKOCHECK_H
