// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the threads of a block do.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_BLOCKS_BLOCKMAPPING_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_BLOCKS_BLOCKMAPPING_H

#include "PikoToGPU/Grid/GridMemory.h"

#include "llvm/ADT/DenseSet.h"

namespace piko {

/// Maps a block's work to its threads: the first thread does what has effects,
/// loops that are marked are shared, iterations of parallel loops are threads,
/// and all else is done by all threads alike.
llvm::LogicalResult mapBlock(GridMemory &memory);

/// Lets a launch leave units to the next one, or begin where they were left;
/// after mapBlock.
void mapRareRounds(GridMemory &memory);

/// Turns a parallel loop of at most as many iterations as the block has threads
/// into what each of these does. What a thread alone does is under tests,
/// which `ofOne` gets; arrays of one iteration go to `ownArrays`.
struct ThreadOperations {
  llvm::DenseSet<mlir::Operation *> ofOne, ownArrays;
};
llvm::LogicalResult mapIterations(ParallelForOp loop,
                                  mlir::gpu::LaunchOp launch,
                                  ThreadOperations &made);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_BLOCKS_BLOCKMAPPING_H
