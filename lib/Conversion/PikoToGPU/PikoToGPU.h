// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the passes to grids of blocks and threads have in common.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_PIKOTOGPU_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_PIKOTOGPU_H

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Whether an operation, or one inside it, is one of those.
template <typename Predicate>
bool contains(mlir::Operation *op, Predicate predicate) {
  return op
      ->walk([&](mlir::Operation *inner) {
        return predicate(inner) ? mlir::WalkResult::interrupt()
                                : mlir::WalkResult::advance();
      })
      .wasInterrupted();
}

/// The operations of a kind inside another one.
template <typename OpT> llvm::SmallVector<OpT> collect(mlir::Operation *op) {
  llvm::SmallVector<OpT> found;
  op->walk([&](OpT inner) { found.push_back(inner); });
  return found;
}

/// Memory that the threads of a block share.
mlir::Value addSharedMemory(mlir::gpu::LaunchOp launch,
                            llvm::ArrayRef<int64_t> shape, mlir::Type type);

/// The launches of a pipeline's kernels that are not mapped to their threads
/// yet.
llvm::SmallVector<mlir::gpu::LaunchOp> findLaunches(PipelineOp pipeline);

/// How many threads the blocks of a launch have: a constant, as
/// piko-form-grids makes it.
int64_t getBlockSize(mlir::gpu::LaunchOp launch);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_PIKOTOGPU_H
