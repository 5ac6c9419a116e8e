// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Grids of kernels: who runs which unit of work.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_GRIDFORMER_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_GRIDFORMER_H

#include "../../Transforms/UnitFormer.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"

namespace piko {

/// The piko.bins of a kernel, or the piko.items of a source.
mlir::Operation *findWork(KernelOp kernel);
/// Whose work that is.
mlir::FlatSymbolRefAttr getStageName(mlir::Operation *work);

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

/// Positions end for those who ask where something was emitted.
void dropEnds(KernelOp kernel, mlir::gpu::LaunchOp launch);

/// What follows `opened` in a block's work is done for one unit of `bins` after
/// the other: the runtime may launch fewer blocks than there are units.
mlir::scf::ForOp repeatForUnits(mlir::gpu::LaunchOp launch, mlir::Value bins,
                                mlir::Operation *opened);

/// Keeps the counter of a loop that all threads run alike in the block's
/// memory. `createEnd` finds the loop's end again.
void countInBlock(mlir::scf::ForOp loop, mlir::gpu::LaunchOp launch,
                  llvm::function_ref<mlir::Value(mlir::OpBuilder &)> createEnd);

/// Does so for the loops over units and cells.
void countWorkInBlock(mlir::scf::ForOp units, mlir::gpu::LaunchOp launch);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_GRIDFORMER_H
