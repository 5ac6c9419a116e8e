// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which work on a primitive belongs to the owner of a pixel, where each thread
// of a block owns some of the pixels of a bin.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_PIXELOWNERS_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_PIXELOWNERS_H

#include "PikoToGPU/Mapping/WorkLegality.h"

namespace piko {

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

/// What a thread does where a coordinate, the root, is one of its own.
struct OwnedWork {
  mlir::Value root;
  /// Of a loop, the iterations in which its counter is the root; otherwise
  /// these operations of one block, in order.
  mlir::Operation *loop = nullptr;
  llvm::SmallVector<mlir::Operation *> operations;

  bool includes(mlir::Operation *op) const {
    return loop ? loop->isProperAncestor(op)
                : llvm::any_of(operations, [&](mlir::Operation *member) {
                    return member->isAncestor(op);
                  });
  }
};

/// All of a dimension of the domain, or why not all that has an effect is one
/// thread's. The iterations of a loop whose counter is `taken` are shared by
/// another dimension.
struct OwnedWorks {
  llvm::SmallVector<OwnedWork> works;
  std::optional<Obstacle> obstacle;
};
OwnedWorks findOwnedWorks(mlir::Operation *items, int64_t dim,
                          const llvm::DenseSet<mlir::Value> &taken = {});

/// Why the threads of a tile cannot share the pixels that a loop over
/// primitives updates, if they cannot.
std::optional<Obstacle> findObstacleToSharing(mlir::Operation *items,
                                              const ThreadTile &tile);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_PIXELOWNERS_H
