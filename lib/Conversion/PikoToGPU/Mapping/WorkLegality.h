// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the threads of a block may share: the one analysis that all ways of
// mapping a block's work to its threads rest on. Nothing in it changes the
// program. Loops over primitives are piko.items, or what a grid has of them.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_WORKLEGALITY_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_WORKLEGALITY_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Why threads cannot do something; without a text where there is nothing to
/// tell a user.
struct Obstacle {
  mlir::Location at;
  std::string text;
};

/// Whether what an operation does is what its regions do.
inline bool hasEffectsOfRegions(mlir::Operation *op) {
  return op->hasTrait<mlir::OpTrait::HasRecursiveMemoryEffects>() ||
         llvm::isa<ParallelLoopOpInterface>(op);
}

/// Whether all that others see of a kernel is its updates of pixels, so that
/// threads can share the pixels of a bin.
bool updatesPixelsAlone(KernelOp kernel);

/// Whether the kernel around is in checking mode: what is wrong is reported in
/// the order of the reference.
bool isChecked(mlir::Operation *op);

/// Whether threads may take the items, or iterations, of a loop in any order.
bool isIndependent(mlir::Operation *loop);

/// Whether iterations that meet at barriers can each be one of the threads.
bool canRunInLockstep(ParallelLoopOpInterface loop, int64_t threads);

/// How many iterations a loop has at most; the largest number where that is not
/// known.
int64_t getMostIterations(ParallelLoopOpInterface loop);

/// Whether threads may have primitives where a bin has many, and take one after
/// the other where it has few, whose iterations they share.
bool canShareByCount(ItemsOp items);

/// Whether a mapping holds for work, or a parallel loop. Where threads share
/// pixels, findPixelNest and findObstacleToSharing say more.
bool isLegal(mlir::Operation *op, ThreadMapping mapping, int64_t threads);

/// The number that a coordinate is, under casts that keep its low bits.
mlir::Value getCoordinateRoot(mlir::Value coordinate);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_WORKLEGALITY_H
