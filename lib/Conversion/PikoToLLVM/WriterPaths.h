// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What emissions do nearly always, without a call of the runtime: what the
// inline functions of pikort/abi.h do.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_WRITERPATHS_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_WRITERPATHS_H

#include "LoweringContext.h"

namespace piko {

/// The place of the next record of a port (pikoir_append).
mlir::Value createAppend(mlir::OpBuilder &builder, mlir::Location loc,
                         LoweringContext &context, mlir::Value writer,
                         int64_t port);
/// Puts a port's latest record into a cell, an i64 (pikoir_place).
void createPlace(mlir::OpBuilder &builder, mlir::Location loc,
                 LoweringContext &context, mlir::Value writer, int64_t port,
                 mlir::Value cell);
/// The same where the port's edge is local.
void createLocalPlace(mlir::OpBuilder &builder, mlir::Location loc,
                      LoweringContext &context, mlir::Value writer,
                      int64_t port, mlir::Value cell);
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
