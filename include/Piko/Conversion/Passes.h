// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes and patterns that take kernels to upstream dialects.

#ifndef PIKO_CONVERSION_PASSES_H
#define PIKO_CONVERSION_PASSES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Func/IR/FuncOps.h"
#include "mlir/Dialect/LLVMIR/LLVMDialect.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Pass/Pass.h"

namespace piko {

/// Updates and other access to state, under tests, as `scf.if`s.
void populatePikoToSCFPatterns(mlir::RewritePatternSet &patterns);

/// The `scf.forall` of a kernel, over OpenMP threads.
void populatePikoToOpenMPPatterns(mlir::RewritePatternSet &patterns);

#define GEN_PASS_DECL
#define GEN_PASS_REGISTRATION
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

#endif // PIKO_CONVERSION_PASSES_H
