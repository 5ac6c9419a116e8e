// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the sequences for a CPU and those for a GPU have in common.

#ifndef PIKO_LIB_DRIVER_SEQUENCEPARTS_H
#define PIKO_LIB_DRIVER_SEQUENCEPARTS_H

#include "Piko/Driver/SynthesisOptions.h"

#include "mlir/Pass/PassManager.h"

namespace piko {

void addCleanUp(mlir::OpPassManager &passes);

/// From loops over units, some of which may have become grids.
void addUnitsToLoops(mlir::OpPassManager &passes,
                     const SynthesisOptions &options);

/// What kernels for a GPU are in; nothing in a build without such.
void registerGPUDialects(mlir::DialectRegistry &registry);

} // namespace piko

#endif // PIKO_LIB_DRIVER_SEQUENCEPARTS_H
