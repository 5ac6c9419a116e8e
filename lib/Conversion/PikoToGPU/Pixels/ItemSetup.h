// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The setup of primitives, split off from the work on their pixels.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_ITEMSETUP_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_ITEMSETUP_H

#include "PikoToGPU/Grid/GridMemory.h"
#include "PikoToGPU/Mapping/PixelOwners.h"
#include "PikoToGPU/Mapping/SetupSplit.h"

#include "mlir/IR/IRMapping.h"
#include "llvm/ADT/MapVector.h"

namespace piko {

class ItemSetup {
public:
  ItemSetup(mlir::scf::ForOp items, const ThreadTile &tile, GridMemory &memory,
            Extent extent);

  bool isEmpty() const { return split.shared.empty(); }
  int64_t countBytes() const { return threads * split.countBytes(); }
  /// Before the loop over the primitives of a group: the setup of the
  /// thread's own, which is the one at `position`. `atPixels` gets, in the
  /// setup, what is left to the pixels where it stood, with the setup's values.
  using PixelHook = llvm::function_ref<void(
      mlir::Operation *, mlir::OpBuilder &, const mlir::IRMapping &)>;
  void createSetup(mlir::OpBuilder &builder, mlir::Value position,
                   PixelHook atPixels = nullptr);
  /// Lets the loop, which counts through a group now, take what it needs from
  /// memory.
  void replaceInPixels();
  /// Moves these loads into loops over pixels that need them outside of the
  /// innermost ones: there they take registers that are short.
  void sinkLoads();

private:
  void cloneSetup(mlir::Block &from, mlir::OpBuilder &to,
                  mlir::IRMapping &mapping, PixelHook atPixels);
  void eraseSetup(mlir::Block &block);
  void placeShared();

  mlir::scf::ForOp items;
  GridMemory &memory;
  int64_t threads;
  SetupSplit split;
  /// Where a value is in memory: the thread's number after `first`.
  struct SharedPlace {
    mlir::Value memory;
    int64_t first = 0;
  };
  llvm::MapVector<mlir::Value, SharedPlace> places; ///< What pixels need.
  llvm::SmallVector<mlir::memref::LoadOp> loads;    ///< What pixels take of it.
};

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_ITEMSETUP_H
