// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What kernels on a GPU cannot do, and which of them can share pixels.

#include "PikoToGPU.h"

#include "../../Transforms/ParallelLoops.h"
#include "../GPUToNVVM/ExactFunctions.h"

#include "llvm/ADT/StringSet.h"

using namespace mlir;
using namespace piko;

/// Whether work in the same kernel takes what is placed.
static bool isOfLocalEdge(PlaceOp place) {
  auto bins = place->getParentOfType<BinsOp>();
  return bins &&
         llvm::any_of(bins.getOps<WorkOpInterface>(),
                      [&](WorkOpInterface piece) {
                        return piece.getProducerAttr() &&
                               piece.getStageAttr() == place.getStageAttr();
                      });
}

LogicalResult piko::checkGridLimits(KernelOp kernel) {
  WalkResult result = kernel.walk([&](Operation *op) -> WalkResult {
    auto place = dyn_cast<PlaceOp>(op);
    if (place && isOfLocalEdge(place) &&
        place.getBin() != place->getParentOfType<BinsOp>().getBin())
      return place.emitError(
          "a kernel for a GPU places what a local edge takes in the same bin");
    if (isa<TileOp>(op))
      return op->emitError("a kernel for a GPU has no tiles; leave out "
                           "piko-form-tiles");
    if (auto loop = dyn_cast<ParallelLoopOpInterface>(op);
        loop && failed(checkParallelLoop(loop)))
      return WalkResult::interrupt();
    if (hasOtherBitsInPTX(op))
      return op->emitError("a kernel for a GPU uses '")
             << op->getName() << "', which has other bits there";
    return WalkResult::advance();
  });
  return failure(result.wasInterrupted());
}

/// What pixels cannot be shared with.
static bool isObstacle(Operation *op) {
  if (isa<EmissionOpInterface, PlaceOp, BarrierOpInterface>(op) ||
      op->hasTrait<CheckingMode>())
    return true;
  if (auto work = dyn_cast<WorkOpInterface>(op))
    return work.takesList() || work.getProducerAttr();
  if (auto access = dyn_cast<StateAccessOpInterface>(op)) {
    auto atomic = dyn_cast<AtomicOp>(op);
    bool isKnown = isa<LoadOp, StoreOp, UpdateOp>(op);
    return atomic ? bool(atomic.getOld()) : !isKnown;
  }
  auto array = dyn_cast<memref::AllocaOp>(op);
  return array && !array.getType().hasStaticShape();
}

bool piko::canSharePixels(KernelOp kernel) {
  llvm::StringSet<> written;
  bool updates = false;
  kernel.walk([&](StateAccessOpInterface access) {
    if (access.getAccessKinds() != StateAccess::reads)
      written.insert(access.getAccessedState().getValue());
    updates |= isa<UpdateOp>(*access);
  });
  return updates &&
         !kernel
              .walk([&](Operation *op) {
                auto access = dyn_cast<StateAccessOpInterface>(op);
                bool readsOwn =
                    access && access.getAccessKinds() == StateAccess::reads &&
                    written.contains(access.getAccessedState().getValue());
                return readsOwn || isObstacle(op) ? WalkResult::interrupt()
                                                  : WalkResult::advance();
              })
              .wasInterrupted();
}
