// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Grids of kernels.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_GRID_GRIDFORMER_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_GRID_GRIDFORMER_H

#include "Piko/Transforms/Storage/UnitFormer.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"

namespace piko {

/// Makes a launch of a kernel's work; a block runs a unit.
class GridFormer : public UnitFormer {
public:
  GridFormer(KernelOp kernel, mlir::Operation *work, int64_t threads)
      : UnitFormer(kernel, work), kernel(kernel), threads(threads) {}

  mlir::gpu::LaunchOp launch;
  mlir::Value log;
  using UnitFormer::bins;

protected:
  void createUnits(StageOp stage, mlir::IntegerAttr source) override;
  mlir::Value createWriter(mlir::Location at,
                           mlir::FlatSymbolRefAttr other) override;

private:
  KernelOp kernel;
  int64_t threads;
};

/// Makes the launch of a kernel that precedes another one a launch of that one,
/// before those that it has.
void launchBefore(KernelOp kernel, KernelOp first);

/// Positions end for those who ask where something was emitted.
void dropEnds(KernelOp kernel, mlir::gpu::LaunchOp launch);

/// Fails, with an error, at what no grid of blocks can do.
llvm::LogicalResult checkGridLimits(KernelOp kernel);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_GRID_GRIDFORMER_H
