// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How phases use state.

#ifndef PIKO_LIB_TRANSFORMS_STATEACCESS_H
#define PIKO_LIB_TRANSFORMS_STATEACCESS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "llvm/ADT/DenseSet.h"

namespace piko {

/// The state that an operation of a phase uses, and how; null if it uses none.
std::pair<mlir::FlatSymbolRefAttr, int> getStateAccess(mlir::Operation *op);

/// The state that operations in `root` change.
llvm::DenseSet<mlir::StringAttr> getWrittenState(mlir::Operation *root);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_STATEACCESS_H
