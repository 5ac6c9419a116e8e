// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops of a block that all its threads run alike: over its units of work, and
// over the buckets of one.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_GRID_UNITLOOPS_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_GRID_UNITLOOPS_H

#include "PikoToGPU/PikoToGPU.h"

namespace piko {

/// Keeps the counter of a loop that all threads run alike in shared memory.
/// `createEnd` finds the loop's end again.
void countInBlock(mlir::scf::ForOp loop, mlir::gpu::LaunchOp launch,
                  llvm::function_ref<mlir::Value(mlir::OpBuilder &)> createEnd);

/// Does so for the loops over the buckets of units.
void countBucketsInBlock(mlir::scf::ForOp units, mlir::gpu::LaunchOp launch);
/// Does so for the loop over units.
void countUnitsInBlock(mlir::scf::ForOp units, mlir::gpu::LaunchOp launch);

/// Each use of a number in a loop gets a load of its own, of shared memory.
void loadForUses(mlir::Value number, mlir::Operation *loop, mlir::Value memory,
                 bool again = true);

/// Lets the block take the units that a loop goes over from a counter of the
/// log, whoever runs them; or, if it `dispatches`, has one that the hardware
/// has begun, where a grid has as many blocks. `inBlock`: the number of the one
/// that it runs is kept in shared memory.
void takeUnits(mlir::scf::ForOp units, mlir::gpu::LaunchOp launch,
               mlir::Value log, bool dispatches, bool inBlock);
/// Lets it do so from the counter of a kernel's second launch.
void takeUnitsForRest(mlir::gpu::LaunchOp launch);

/// Puts what a loop that all threads run needs of what is around it, and is the
/// same for all of them, into shared memory, where each use finds it.
void keepInBlock(mlir::scf::WhileOp loop, mlir::gpu::LaunchOp launch);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_GRID_UNITLOOPS_H
