// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Parallel loops in other forms.

#ifndef PIKO_TRANSFORMS_STORAGE_PARALLELLOOPS_H
#define PIKO_TRANSFORMS_STORAGE_PARALLELLOOPS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Reports a parallel loop of which it is not known how to make other loops.
mlir::LogicalResult checkParallelLoop(ParallelLoopOpInterface loop);

/// A loop as loops that run its iterations one after the other; returns the
/// innermost, which is marked with `piko.lanes`. Barriers stay where they are.
mlir::scf::ForOp convertLoop(ParallelLoopOpInterface loop);

/// The same iterations by their numbers.
ParallelForOp numberIterations(ParallelPixelsOp pixels);

/// How often a loop runs (index); its numbers are of any integer type.
mlir::Value createTripCount(mlir::OpBuilder &builder, mlir::scf::ForOp loop);

} // namespace piko

#endif // PIKO_TRANSFORMS_STORAGE_PARALLELLOOPS_H
