// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that stay inside the `piko` dialect.

#ifndef PIKO_TRANSFORMS_PASSES_H
#define PIKO_TRANSFORMS_PASSES_H

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/Pass/Pass.h"

namespace piko {
#define GEN_PASS_DECL
#define GEN_PASS_REGISTRATION
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

#endif // PIKO_TRANSFORMS_PASSES_H
