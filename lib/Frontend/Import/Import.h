//===- Import.h - From cleaned LLVM IR to structured MLIR -------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is left of a phase after the clean-up is small enough to be written in
// arith, math, memref and piko directly, with cf for its branches, which are
// then lifted to scf. MLIR's own import of LLVM IR would give a detour by the
// llvm dialect, in which addresses are harder to follow, for as many patterns.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_LIB_FRONTEND_IMPORT_IMPORT_H
#define PIKO_LIB_FRONTEND_IMPORT_IMPORT_H

#include "Parse/Parse.h"
#include "Parse/Wrappers.h"
#include "Support/Memory.h"
#include "mlir/Dialect/Func/IR/FuncOps.h"

namespace piko {

/// Writes the code of a stage's phase into a function of its primitive; null
/// after an error. Updates, reductions and scans are still pairs of placeholder
/// calls.
mlir::OwningOpRef<mlir::func::FuncOp>
importPhase(llvm::Function &function, WrapperKind phase, unsigned stage,
            ParsedUnit &unit, MemoryMap &memory, mlir::MLIRContext &context);

/// Lifts branches to scf and resolves the placeholders.
llvm::LogicalResult structurePhase(mlir::func::FuncOp function);

/// Makes piko.update, piko.reduce and piko.scan of their placeholders.
llvm::LogicalResult resolveBrackets(mlir::func::FuncOp function);

/// The name of the placeholder that ends what this one begins; empty if it
/// begins nothing.
llvm::StringRef getBracketEnd(mlir::func::CallOp begin);

/// The placeholders: calls of functions that do not exist.
constexpr llvm::StringLiteral updateBeginName = "piko.update_begin.";
constexpr llvm::StringLiteral updateEndName = "piko.update_end";
constexpr llvm::StringLiteral reduceBeginName = "piko.reduce_begin";
constexpr llvm::StringLiteral scanBeginName = "piko.scan_begin";
constexpr llvm::StringLiteral combineEndName = "piko.combine_end";

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_IMPORT_H
