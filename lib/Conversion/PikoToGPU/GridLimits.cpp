// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What kernels on a GPU cannot do yet.

#include "PikoToGPU.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "../GPUToNVVM/ExactFunctions.h"

#include "llvm/ADT/StringMap.h"

using namespace mlir;
using namespace piko;

/// What is wrong with an operation by itself; empty if nothing.
static std::string findObstacle(Operation *op) {
  if (isa<AppendOp, AppendBinOp, LocalBinOp>(op))
    return "emits primitives";
  if (isa<ListOp, ListSizeOp, ListAtOp, CallRangeOp, CallBinOp>(op))
    return "takes a list of primitives";
  if (isa<DeferBeginOp, DeferIterationOp, DeferEndOp, ScratchOp, ScratchMarkOp,
          ScratchReleaseOp, FailBarrierOp>(op))
    return "has iterations that meet at barriers";
  if (op->getName().getStringRef().starts_with("piko.check_"))
    return "is in checking mode";
  if (hasOtherBitsInPTX(op))
    return ("uses '" + op->getName().getStringRef() +
            "', which has other bits there")
        .str();
  if (auto atomic = dyn_cast<AtomicOp>(op); atomic && atomic.getOld())
    return "uses what an atomic operation found";
  if (auto array = dyn_cast<memref::AllocaOp>(op);
      array && !array.getType().hasStaticShape())
    return "has an array whose size is not constant";
  return "";
}

LogicalResult piko::checkGridLimits(KernelOp kernel) {
  llvm::StringMap<Operation *> written;
  kernel.walk([&](Operation *op) {
    if (auto update = dyn_cast<UpdateOp>(op))
      written.try_emplace(update.getImage(), op);
    else if (auto store = dyn_cast<StoreOp>(op))
      written.try_emplace(store.getState(), op);
    else if (auto atomic = dyn_cast<AtomicOp>(op))
      written.try_emplace(atomic.getState(), op);
  });
  WalkResult result = kernel.walk([&](Operation *op) {
    std::string obstacle = findObstacle(op);
    if (!obstacle.empty()) {
      op->emitError("a kernel for a GPU ") << obstacle
                                           << ", which is not "
                                              "supported yet";
      return WalkResult::interrupt();
    }
    auto load = dyn_cast<LoadOp>(op);
    if (!load || !written.contains(load.getState()))
      return WalkResult::advance();
    InFlightDiagnostic error =
        load.emitError("a kernel for a GPU reads '")
        << load.getState()
        << "', which it also writes; this is not supported "
           "yet";
    error.attachNote(written.lookup(load.getState())->getLoc())
        << "it is written here";
    return WalkResult::interrupt();
  });
  return failure(result.wasInterrupted());
}
