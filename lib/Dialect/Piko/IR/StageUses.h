// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Checks that several kinds of operations share.

#ifndef PIKO_LIB_DIALECT_PIKO_IR_STAGEUSES_H
#define PIKO_LIB_DIALECT_PIKO_IR_STAGEUSES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Reports at `op` unless the pipeline has a stage of that name.
mlir::LogicalResult verifyStage(mlir::Operation *op,
                                mlir::FlatSymbolRefAttr name);

/// Reports at `op` unless `consumer` may run, bin by bin, in the kernel of the
/// stage that feeds it.
mlir::LogicalResult verifyLocalEdge(mlir::Operation *op,
                                    mlir::FlatSymbolRefAttr producer,
                                    int64_t port,
                                    mlir::FlatSymbolRefAttr consumer);

/// Reports at `op` unless the pipeline's source of that number, if any is said,
/// feeds the stage.
mlir::LogicalResult verifySource(mlir::Operation *op,
                                 std::optional<int64_t> number,
                                 mlir::FlatSymbolRefAttr stage);

/// Reports at `op` unless so many coordinates are its pipeline's rank.
mlir::LogicalResult verifyRank(mlir::Operation *op, size_t coordinates);

/// Reports operations in a phase, or in work, that cannot be there, or of which
/// it is not known what they do.
mlir::LogicalResult verifyPhaseBody(mlir::Operation *phase);

} // namespace piko

#endif // PIKO_LIB_DIALECT_PIKO_IR_STAGEUSES_H
