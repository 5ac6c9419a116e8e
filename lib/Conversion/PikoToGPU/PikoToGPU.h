// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The parts of convert-piko-to-gpu.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_PIKOTOGPU_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_PIKOTOGPU_H

#include "Piko/Conversion/Passes.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Fails, with an error, at what a grid of blocks cannot do yet.
llvm::LogicalResult checkGridLimits(KernelOp kernel);

/// How the threads of a block share the pixels of a bin: a tile of as many
/// pixels as there are threads is laid over the domain again and again.
struct ThreadTile {
  /// `threads` is a power of two; it is split evenly over the dimensions, the
  /// first ones before the others.
  ThreadTile(int64_t threads, int64_t rank);

  /// Powers of two, so that arithmetic that wraps cannot change whose a pixel
  /// is.
  llvm::SmallVector<int64_t> extents;
  /// The thread's place in the tile.
  llvm::SmallVector<mlir::Value> place;
};

struct SharingCounts {
  int64_t strided = 0, guarded = 0;
};

/// Leaves to each thread the updates of its own pixels, and what follows from
/// them, in a loop over primitives that all threads run.
llvm::LogicalResult sharePixels(mlir::scf::ForOp items, const ThreadTile &tile,
                                SharingCounts &counts);

/// Memory that the threads of a block share.
mlir::Value addBlockMemory(mlir::gpu::LaunchOp launch, int64_t count,
                           mlir::Type type);

/// Notes the first `piko.fail` of each thread, and reports behind the launch
/// that of the first block, and in it of the first position and thread. `items`
/// is the loop over a group of primitives, inside that over groups.
void gatherGridErrors(mlir::gpu::LaunchOp launch, mlir::scf::ForOp items);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_PIKOTOGPU_H
