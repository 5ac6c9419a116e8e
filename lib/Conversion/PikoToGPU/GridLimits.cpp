// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What kernels on a GPU cannot do, and which of them can share pixels.

#include "PikoToGPU.h"

#include "../GPUToNVVM/ExactFunctions.h"

#include "llvm/ADT/StringSet.h"

using namespace mlir;
using namespace piko;

/// Whether work in the same kernel takes what is placed.
static bool isLocal(PlaceOp place) {
  auto bins = place->getParentOfType<BinsOp>();
  return bins && llvm::any_of(*bins.getBodyBlock(), [&](Operation &piece) {
           return piece.hasAttr("producer") &&
                  piece.getAttr("stage") == place.getStageAttr();
         });
}

LogicalResult piko::checkGridLimits(KernelOp kernel) {
  WalkResult result = kernel.walk([&](Operation *op) -> WalkResult {
    auto place = dyn_cast<PlaceOp>(op);
    if (place && isLocal(place) &&
        place.getBin() != place->getParentOfType<BinsOp>().getBin())
      return place.emitError(
          "a kernel for a GPU places what a local edge takes in the same bin");
    if (isa<TileOp>(op))
      return op->emitError("a kernel for a GPU has no tiles; leave out "
                           "piko-form-tiles");
    if (hasOtherBitsInPTX(op))
      return op->emitError("a kernel for a GPU uses '")
             << op->getName() << "', which has other bits there";
    return WalkResult::advance();
  });
  return failure(result.wasInterrupted());
}

/// What pixels cannot be shared with.
static bool isObstacle(Operation *op) {
  if (isa<EmitOp, PlaceOp, ListsOp, BarrierOpInterface>(op) ||
      op->hasAttr("producer") || op->hasTrait<CheckingMode>())
    return true;
  if (auto atomic = dyn_cast<AtomicOp>(op))
    return bool(atomic.getOld());
  auto array = dyn_cast<memref::AllocaOp>(op);
  return array && !array.getType().hasStaticShape();
}

bool piko::canSharePixels(KernelOp kernel) {
  llvm::StringSet<> written;
  bool updates = false;
  kernel.walk([&](Operation *op) {
    if (auto update = dyn_cast<UpdateOp>(op))
      written.insert(update.getImage());
    else if (auto store = dyn_cast<StoreOp>(op))
      written.insert(store.getState());
    else if (auto atomic = dyn_cast<AtomicOp>(op))
      written.insert(atomic.getState());
    updates |= isa<UpdateOp>(op);
  });
  return updates &&
         !kernel
              .walk([&](Operation *op) {
                auto load = dyn_cast<LoadOp>(op);
                bool readsOwn = load && written.contains(load.getState());
                return readsOwn || isObstacle(op) ? WalkResult::interrupt()
                                                  : WalkResult::advance();
              })
              .wasInterrupted();
}
