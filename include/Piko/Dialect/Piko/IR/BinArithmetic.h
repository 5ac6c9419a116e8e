// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bins as arithmetic: from the number of a bin to cells of the domain and back.

#ifndef PIKO_DIALECT_PIKO_IR_BINARITHMETIC_H
#define PIKO_DIALECT_PIKO_IR_BINARITHMETIC_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Emits index arithmetic on the bins of one stage.
class BinArithmetic {
public:
  BinArithmetic(mlir::OpBuilder &builder, mlir::Location loc, StageOp stage)
      : builder(builder), loc(loc), stage(stage) {}

  int64_t rank() { return stage.getBins().size(); }
  /// The extent of a bin, 0 for the whole domain.
  int64_t extent(int64_t dim) { return stage.getBins()[dim]; }

  mlir::Value constant(int64_t value);
  /// A coordinate of any integer type, sign-extended to index.
  mlir::Value toIndex(mlir::Value coordinate);
  /// Bins in a dimension, and in all.
  mlir::Value grid(int64_t dim);
  mlir::Value binCount();
  /// The first cell of a bin in a dimension, and the one after its last.
  mlir::Value lo(mlir::Value bin, int64_t dim);
  mlir::Value hi(mlir::Value bin, int64_t dim);
  /// The same of the bin at a place in the grid.
  mlir::Value loAt(mlir::Value place, int64_t dim);
  mlir::Value hiAt(mlir::Value place, int64_t dim);
  /// The bin of a cell, -1 where it is outside the domain.
  mlir::Value binAt(mlir::ValueRange coordinates);
  /// The tile, within `bin`, of a cell; cells outside count as the nearest.
  mlir::Value tileAt(mlir::Value bin, mlir::ValueRange coordinates);
  /// Calls `body` with each bin that a closed box of cells touches, ascending,
  /// and its place in the grid.
  void forEachBinIn(
      mlir::ValueRange lo, mlir::ValueRange hi,
      llvm::function_ref<void(mlir::OpBuilder &, mlir::Value, mlir::ValueRange)>
          body);
  /// Whether all of lo <= at < hi.
  mlir::Value isInside(mlir::ValueRange at, mlir::ValueRange lo,
                       mlir::ValueRange hi);
  /// Whether a cell is in a bin.
  mlir::Value isInBin(mlir::ValueRange at, mlir::Value bin);
  /// Whether a buffer or image has an element with these indices.
  mlir::Value isInState(llvm::StringRef state, mlir::ValueRange indices);

private:
  mlir::Value gridCoordinate(mlir::Value bin, int64_t dim);

  mlir::OpBuilder &builder;
  mlir::Location loc;
  StageOp stage;
};

/// The bin of the call of Process that an operation of a kernel is
/// in, or null.
mlir::Value findBin(mlir::OpBuilder &builder, mlir::Operation *op);

} // namespace piko

#endif // PIKO_DIALECT_PIKO_IR_BINARITHMETIC_H
