//===- ModuleBuilder.h - A described pipeline as a module -------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_IMPORT_MODULEBUILDER_H
#define PIKO_LIB_FRONTEND_IMPORT_MODULEBUILDER_H

#include "Parse/Parse.h"
#include "Support/Memory.h"

namespace piko {

/// Writes the pipeline at the authored level; null after an error.
mlir::OwningOpRef<mlir::ModuleOp>
buildModule(ParsedUnit &unit, MemoryMap &memory, mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_MODULEBUILDER_H
