// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Reductions, scans and sorts over the slots of iterations, one or more.

#ifndef PIKO_TRANSFORMS_STORAGE_COLLECTIVES_H
#define PIKO_TRANSFORMS_STORAGE_COLLECTIVES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Combines the slots: slot 0 of each array gets the result.
void createReduction(mlir::OpBuilder &builder, mlir::Location loc,
                     mlir::Value count, mlir::ValueRange slots,
                     mlir::Block &combine);

/// Slot i of each array gets what the slots before it combine to; slot 0 is
/// unspecified.
void createScan(mlir::OpBuilder &builder, mlir::Location loc, mlir::Value count,
                mlir::ValueRange slots, mlir::Block &combine);

/// Slot i of `ranks` (index) gets the number of the i-th smallest key; `room`
/// has twice as many elements (index).
void createSort(mlir::OpBuilder &builder, mlir::Location loc, mlir::Value count,
                mlir::Value keys, bool isUnsigned, mlir::Value room,
                mlir::Value ranks);

/// The same, with the same bits, where lanes share the loops inside: these are
/// marked, count by one, and have independent iterations.
void createSharedReduction(mlir::OpBuilder &builder, mlir::Location loc,
                           mlir::Value count, mlir::ValueRange slots,
                           mlir::Block &combine);
void createSharedScan(mlir::OpBuilder &builder, mlir::Location loc,
                      mlir::Value count, mlir::ValueRange slots,
                      mlir::Block &combine);
void createSharedSort(mlir::OpBuilder &builder, mlir::Location loc,
                      mlir::Value count, mlir::Value keys, bool isUnsigned,
                      mlir::Value room, mlir::Value ranks);

/// What the body of a reduction or a scan gives for two values.
llvm::SmallVector<mlir::Value> createCombination(mlir::OpBuilder &builder,
                                                 mlir::Location loc,
                                                 mlir::Block &combine,
                                                 mlir::ValueRange left,
                                                 mlir::ValueRange right);

/// Whether a < b; NaNs are equal to each other and greater than all else.
mlir::Value createLess(mlir::OpBuilder &builder, mlir::Location loc,
                       mlir::Value a, mlir::Value b, bool isUnsigned);

} // namespace piko

#endif // PIKO_TRANSFORMS_STORAGE_COLLECTIVES_H
