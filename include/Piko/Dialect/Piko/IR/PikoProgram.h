// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The operations of programs.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOPROGRAM_H
#define PIKO_DIALECT_PIKO_IR_PIKOPROGRAM_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "Piko/Dialect/Piko/IR/PikoProgramEnums.h.inc"

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoProgramOps.h.inc"

namespace piko {

/// The program of a pipeline, or null.
ProgramOp getProgram(PipelineOp pipeline);

/// Where the program of a kernel's pipeline launches it; null if it does not,
/// or in several places.
LaunchOp findLaunch(KernelOp kernel);

/// The stages whose process phases run in a kernel, in order; none in that of
/// a source or of a schedule. At the kernels level and below.
llvm::SmallVector<StageOp> getStages(KernelOp kernel);

/// The source whose primitives a kernel assigns to bins, if it does that.
std::optional<int64_t> getAssignedSource(KernelOp kernel);

/// The edges that a kernel emits to, as a launch has results for them.
llvm::SmallVector<EdgeOp> getEmittedEdges(KernelOp kernel);

/// Whether the consumer of an edge runs in the producer's kernel.
bool isLocal(EdgeOp edge);

/// Where the primitives of a value of type `!piko.edge` come from: a
/// `piko.source` or a `piko.edge`; null if nowhere.
mlir::Operation *getOrigin(mlir::Value edge);

} // namespace piko

#endif // PIKO_DIALECT_PIKO_IR_PIKOPROGRAM_H
