// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Pipelines drawn as graphs.

#ifndef PIKO_TARGET_GRAPHVIZ_H
#define PIKO_TARGET_GRAPHVIZ_H

#include "mlir/IR/BuiltinOps.h"
#include "llvm/Support/LogicalResult.h"
#include "llvm/Support/raw_ostream.h"

namespace piko {

/// Writes each pipeline of a module as a graph in Graphviz's language: stages
/// are nodes, edges carry the record and the port that flows along them, a
/// source and a drain are where primitives come in and end. At the kernels
/// level each kernel is a box around its phases.
llvm::LogicalResult writeDot(mlir::ModuleOp module, llvm::raw_ostream &stream);

/// Registers `piko-translate --piko-to-dot`.
void registerPikoToDotTranslation();

} // namespace piko

#endif // PIKO_TARGET_GRAPHVIZ_H
