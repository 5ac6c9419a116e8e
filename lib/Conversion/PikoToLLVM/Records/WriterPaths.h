// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What lanes emit at once, by the inline functions of pikort/emission.h.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_WRITERPATHS_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_WRITERPATHS_H

#include "PikoToLLVM/LoweringContext.h"

namespace piko {

/// What lanes emit to a port: a bit for each in an i64, and the buckets.
struct LaneEmissions {
  int64_t port, lanes;
  llvm::SmallVector<mlir::Value> bits, buckets;
};
/// pikoir_append for each of the records that are written after one another.
void createAppendLanes(mlir::OpBuilder &builder, mlir::Location loc,
                       LoweringContext &context, mlir::Value writer,
                       const LaneEmissions &emissions);
/// The same where each is put into a bucket.
void createPlaceLanes(mlir::OpBuilder &builder, mlir::Location loc,
                      LoweringContext &context, mlir::Value writer,
                      const LaneEmissions &emissions, bool isLocal);
/// Whether the edge from a port to a stage is local, or each of them if several
/// may be meant.
bool isLocalEdge(mlir::Operation *op, int64_t port,
                 mlir::FlatSymbolRefAttr stage, LoweringContext &context);
/// How many tiles a bin of a stage has.
mlir::Value createTileCount(mlir::OpBuilder &builder, mlir::Operation *op,
                            mlir::FlatSymbolRefAttr stage,
                            LoweringContext &context);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_WRITERPATHS_H
