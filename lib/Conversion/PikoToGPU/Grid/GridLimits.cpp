// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What kernels on a GPU cannot do.

#include "PikoToGPU/Grid/GridFormer.h"

#include "GPUToNVVM/ExactFunctions.h"
#include "Piko/Transforms/Storage/ParallelLoops.h"

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
