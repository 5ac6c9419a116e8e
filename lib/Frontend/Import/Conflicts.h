//===- Conflicts.h - Stores that are bound to conflict ----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_IMPORT_CONFLICTS_H
#define PIKO_LIB_FRONTEND_IMPORT_CONFLICTS_H

namespace mlir {
class ModuleOp;
} // namespace mlir

namespace piko {

/// Warns of stores that all primitives, or all iterations of a parallel loop,
/// make to one element, each with a value of its own: a data race whatever the
/// input is, as soon as there are two.
void warnAboutConflicts(mlir::ModuleOp module);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_CONFLICTS_H
