//===- Wiring.h - What a pipeline's code says once --------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_IMPORT_WIRING_H
#define PIKO_LIB_FRONTEND_IMPORT_WIRING_H

#include "Parse/Parse.h"
#include "Support/Memory.h"

namespace piko {

/// Reads edges, sources, schedules and clear values from the cleaned wrappers
/// into the unit's description, and checks the graph. False after an error.
bool readWiring(ParsedUnit &unit, MemoryMap &memory,
                mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_WIRING_H
