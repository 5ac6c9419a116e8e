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

/// Fails, with an error, at what no grid of blocks can do.
llvm::LogicalResult checkGridLimits(KernelOp kernel);

/// Whether the threads of a block can share the pixels of a bin: the kernel
/// updates some and does nothing else that other primitives see.
bool canSharePixels(KernelOp kernel);

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

/// Marks the loops whose iterations the threads of a block may share: what they
/// do has no order that shows but that of emissions.
void findSharedLoops(KernelOp kernel);
constexpr const char *sharedAttrName = "piko.shared";

/// Maps a block's work to its threads: the first thread does what has effects,
/// loops that are marked are shared, and all else is done by all threads alike.
/// `log` takes what is emitted.
llvm::LogicalResult mapBlock(mlir::gpu::LaunchOp launch, mlir::Value log,
                             int64_t &sharedLoops);

/// What every GPU's blocks have.
constexpr int64_t maxThreads = 1024, maxBlockBytes = 48 << 10;

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_PIKOTOGPU_H
