// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The form that rasterizers have: for the pixels of a box of the primitive, if
// a test holds, update the pixel.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_PIXELNEST_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_PIXELNEST_H

#include "PikoToGPU/Mapping/WorkLegality.h"

namespace piko {

/// A loop that counts by one, and hands on nothing: an scf.for, a
/// piko.parallel_for, or a dimension of piko.parallel_pixels.
struct PixelLoop {
  mlir::Operation *op;
  unsigned dim = 0; ///< Of piko.parallel_pixels.

  mlir::Value getCounter() const { return op->getRegion(0).getArgument(dim); }
  /// Null where it counts from 0.
  mlir::Value getFirst() const;
  mlir::Value getEnd() const;
};
/// Nothing for another operation.
llvm::SmallVector<PixelLoop, 3> getPixelLoops(mlir::Operation *op);

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
  llvm::SmallVector<PixelLoop> loops;
  /// What is done for a pixel that passes the tests.
  mlir::Block *work = nullptr;
  /// The first operation of it all that has an effect and is no condition of
  /// the primitive: the outermost loop, if there is one.
  mlir::Operation *anchor = nullptr;
  UpdateOp update; ///< Any: all are of the same pixel.
  /// Other branches of conditions before the nest, with effects: a
  /// primitive that takes one is *rare*.
  llvm::SmallVector<mlir::Block *> rare;

  int64_t getRank() { return update.getCoordinates().size(); }
  /// The loop over a dimension, or null.
  const PixelLoop *getLoop(int64_t dim);
  /// Where the pixels of a dimension begin.
  mlir::Value getFirst(int64_t dim) {
    const PixelLoop *loop = getLoop(dim);
    return loop ? loop->getFirst() : getCoordinate(dim);
  }
  /// What counts them, or the one coordinate.
  mlir::Value getNumber(int64_t dim) {
    const PixelLoop *loop = getLoop(dim);
    return loop ? loop->getCounter() : getCoordinate(dim);
  }
  /// Of a dimension without a loop.
  mlir::Value getCoordinate(int64_t dim) {
    return update.getCoordinates()[dim];
  }
  bool isInside(mlir::Operation *op) {
    return !loops.empty() && loops.front().op->isProperAncestor(op);
  }
};

/// Finds the one nest that a loop over primitives has, apart from rare
/// branches; otherwise says why there is none. The loop is piko.items, or what
/// a grid has of it.
struct PixelNestResult {
  std::optional<PixelNest> nest;
  Obstacle obstacle;
};
PixelNestResult findPixelNest(mlir::Operation *items, StageOp stage);

/// Lets no integer go from pixel to pixel that is another function of the
/// pixel.
void useClosedFormsInPixelLoops(mlir::Operation *items);

/// Moves what does not differ between pixels out of the loops over them.
void hoistOutOfPixelLoops(mlir::Operation *items);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_PIXELNEST_H
