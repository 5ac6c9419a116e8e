// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Queues of what iterations of shared loops have put off (piko.gpu.drain).

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_BLOCKS_WORKQUEUE_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_BLOCKS_WORKQUEUE_H

#include "PikoToGPU/Grid/GridMemory.h"

namespace piko {

/// How many classes of length a queue has.
constexpr int64_t lengthClasses = 32;

/// After a round of iterations, in which as many as there are threads may have
/// come: does the work if there may be no room for another round, or `isLast`.
/// The loop over entries, of which each thread takes some.
mlir::scf::ForOp drainQueue(DrainOp drain, mlir::OpBuilder &builder,
                            mlir::Value isLast);

/// Nothing waits where a block begins.
void clearQueue(mlir::OpBuilder &builder, DrainOp drain);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_BLOCKS_WORKQUEUE_H
