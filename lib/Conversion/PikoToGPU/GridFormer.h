// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Grids of kernels: who runs which unit of work.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_GRIDFORMER_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_GRIDFORMER_H

#include "Piko/Transforms/Storage/UnitFormer.h"

#include "Piko/Conversion/UnitOrder.h"

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

/// What follows `opened` in a block's work is done for one unit of `bins` after
/// the other: the runtime may launch fewer blocks than there are units.
mlir::scf::ForOp repeatForUnits(mlir::gpu::LaunchOp launch, mlir::Value bins,
                                mlir::Operation *opened);

/// Keeps the counter of a loop that all threads run alike in shared memory.
/// `createEnd` finds the loop's end again.
void countInBlock(mlir::scf::ForOp loop, mlir::gpu::LaunchOp launch,
                  llvm::function_ref<mlir::Value(mlir::OpBuilder &)> createEnd);

/// Does so for the loops over the buckets of units.
void countBucketsInBlock(mlir::scf::ForOp units, mlir::gpu::LaunchOp launch);
/// Does so for the loop over units.
void countUnitsInBlock(mlir::scf::ForOp units, mlir::gpu::LaunchOp launch);

/// Each use of a number in a loop gets a load of its own, of shared memory.
void loadForUses(mlir::Value number, mlir::Operation *loop, mlir::Value memory,
                 bool again = true);

/// Lets the block take the units that a loop goes over from a counter of the
/// log, whoever runs them; or, if it `dispatches`, has one that the hardware
/// has begun, where a grid has as many blocks. `inBlock`: the number of the one
/// that it runs is kept in shared memory.
void takeUnits(mlir::scf::ForOp units, mlir::gpu::LaunchOp launch,
               mlir::Value log, bool dispatches, bool inBlock);
/// Lets it do so from the counter of a kernel's second launch.
void takeUnitsForRest(mlir::gpu::LaunchOp launch);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_GRIDFORMER_H
