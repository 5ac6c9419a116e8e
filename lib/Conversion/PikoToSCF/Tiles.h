// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Tiles as private arrays of the thread that runs a bin.

#ifndef PIKO_LIB_CONVERSION_PIKOTOSCF_TILES_H
#define PIKO_LIB_CONVERSION_PIKOTOSCF_TILES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Calls `body` with each number of a record: its field, and its indices into
/// an array.
void forEachElement(mlir::OpBuilder &builder, mlir::Location loc,
                    RecordOp record,
                    llvm::function_ref<void(FieldAttr, mlir::ValueRange)> body);

/// Makes arrays of tiles, one a field, and loops of what fills them and writes
/// them back. Updates have become loads and stores.
void lowerTiles(PipelineOp pipeline);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOSCF_TILES_H
