// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What emissions do nearly always, without a call of the runtime: what the
// inline functions of pikort/abi.h do.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_WRITERPATHS_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_WRITERPATHS_H

#include "PikoToLLVM/LoweringContext.h"

namespace piko {

/// Whether a unit runs a loop of its kernel as vectors, by its number.
mlir::Value createTakesVectors(mlir::OpBuilder &builder, mlir::Location loc,
                               LoweringContext &context, mlir::Value writer,
                               int64_t number);
/// The place of the next record of a port (pikoir_append).
mlir::Value createAppend(mlir::OpBuilder &builder, mlir::Location loc,
                         LoweringContext &context, mlir::Value writer,
                         int64_t port);
/// Puts a port's latest record into a bucket, an i64 (pikoir_place).
void createPlace(mlir::OpBuilder &builder, mlir::Location loc,
                 LoweringContext &context, mlir::Value writer, int64_t port,
                 mlir::Value bucket);
/// The same where the port's edge is local.
void createLocalPlace(mlir::OpBuilder &builder, mlir::Location loc,
                      LoweringContext &context, mlir::Value writer,
                      int64_t port, mlir::Value bucket);
/// Where so many records of a port may be written (pikoir_reserve).
mlir::Value createReserve(mlir::OpBuilder &builder, mlir::Location loc,
                          LoweringContext &context, mlir::Value writer,
                          int64_t port, int64_t count);
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
/// Whether pikoir_next has anything to do.
mlir::Value createIsCounted(mlir::OpBuilder &builder, mlir::Location loc,
                            LoweringContext &context, mlir::Value writer);
/// Ends a primitive of a source, to whose AssignBin the writer belongs.
void createSourceNext(mlir::OpBuilder &builder, mlir::Location loc,
                      LoweringContext &context, mlir::Value writer);
/// Ends a position (pikoir_next).
void createNext(mlir::OpBuilder &builder, mlir::Location loc,
                LoweringContext &context, mlir::Value writer);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_WRITERPATHS_H
