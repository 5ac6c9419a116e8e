// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The form that rasterizers have: for the pixels of a box of the primitive, if
// a test holds, update the pixel.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELNEST_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELNEST_H

#include "PikoToGPU.h"

namespace piko {

/// Loops over the pixels of a box, in a loop over primitives. In dimensions
/// without a loop a primitive has one coordinate.
struct PixelNest {
  /// A block on the way from the loop over primitives to the work on a pixel,
  /// and the one operation of it that has an effect: a condition or a loop.
  struct Level {
    mlir::Block *block;
    mlir::Operation *next;
  };
  /// From the outside in.
  llvm::SmallVector<Level> levels;
  llvm::SmallVector<mlir::scf::ForOp> loops;
  /// What is done for a pixel that passes the tests.
  mlir::Block *work = nullptr;
  /// The first operation of it all that has an effect and is no condition of
  /// the primitive: the outermost loop, if there is one.
  mlir::Operation *anchor = nullptr;
  UpdateOp update; ///< Any: all are of the same pixel.
  /// Other branches of conditions in front of the nest, with effects: a
  /// primitive that takes one is *rare*.
  llvm::SmallVector<mlir::Block *> rare;

  int64_t getRank() { return update.getCoordinates().size(); }
  /// The loop over a dimension, or null.
  mlir::scf::ForOp getLoop(int64_t dim);
  /// Of a dimension without a loop.
  mlir::Value getCoordinate(int64_t dim) {
    return update.getCoordinates()[dim];
  }
  bool isInside(mlir::Operation *op) {
    return !loops.empty() && loops.front()->isProperAncestor(op);
  }
};

/// Finds the one nest that a loop over primitives has, apart from rare
/// branches; otherwise says why there is none.
struct PixelNestResult {
  std::optional<PixelNest> nest;
  mlir::Location at;
  std::string obstacle;
};
PixelNestResult findPixelNest(mlir::scf::ForOp items, StageOp stage);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELNEST_H
