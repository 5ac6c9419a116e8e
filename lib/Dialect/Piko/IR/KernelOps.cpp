// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Kernels, and the phases in them.

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "StageUses.h"

using namespace mlir;
using namespace piko;

ProcessOp KernelOp::getProcess() {
  for (auto process : getOps<ProcessOp>())
    return process;
  return {};
}

/// Each process phase but the first stands after a barrier that names it.
static LogicalResult verifyBarriers(KernelOp kernel) {
  llvm::SmallDenseSet<Attribute> before;
  for (Operation &op : *kernel.getBodyBlock()) {
    if (auto process = dyn_cast<ProcessOp>(op)) {
      auto barrier = dyn_cast_or_null<LocalBarrierOp>(op.getPrevNode());
      if (!before.empty() &&
          (!barrier || barrier.getConsumerAttr() != process.getStageAttr()))
        return process.emitOpError("expected to be the first of its kernel, or "
                                   "after a local barrier that names ")
               << process.getStageAttr();
      if (!before.insert(process.getStageAttr()).second)
        return process.emitOpError("expected one process phase of ")
               << process.getStageAttr();
    }
    auto barrier = dyn_cast<LocalBarrierOp>(op);
    if (!barrier)
      continue;
    if (!before.contains(barrier.getProducerAttr()))
      return barrier.emitOpError("expected the process phase of ")
             << barrier.getProducerAttr() << " before it";
    if (!isa_and_nonnull<ProcessOp>(op.getNextNode()))
      return barrier.emitOpError("expected to stand before a process "
                                 "phase");
  }
  return success();
}

/// Kernels hold phases (the kernels level), work (the machine level), or what a
/// target has made of it.
static LogicalResult verifyLevel(KernelOp kernel) {
  Operation *phase = nullptr, *work = nullptr, *other = nullptr;
  for (Operation &op : *kernel.getBodyBlock()) {
    if (isa<AssignOp, ProcessOp, LocalBarrierOp>(op))
      phase = &op;
    else if (isa<BinsOp, ItemsOp>(op))
      work = &op;
    else
      other = &op;
  }
  if (phase && (work || other))
    return kernel.emitOpError(
        "expected phases (the kernels level) or work (the "
        "machine level), but got both");
  if (!work)
    return success();
  WalkResult result = kernel.walk([](Operation *op) {
    if (!op->hasTrait<TargetLevel>())
      return WalkResult::advance();
    op->emitOpError(
        "expected no operation of the CPU in a kernel of the machine "
        "level");
    return WalkResult::interrupt();
  });
  return failure(result.wasInterrupted());
}

/// Whether a kernel leaves something in order: it emits, or updates pixels.
static bool leavesInOrder(KernelOp kernel) {
  return kernel
      ->walk([](Operation *op) {
        return isa<EmissionOpInterface, PlaceOp, UpdateOp>(op)
                   ? WalkResult::interrupt()
                   : WalkResult::advance();
      })
      .wasInterrupted();
}

/// Both take the bins of one stage, and the first one leaves nothing in order.
static LogicalResult verifyPrecedes(KernelOp kernel) {
  if (!kernel.getPrecedes())
    return success();
  auto next = lookupInPipeline<KernelOp>(kernel, kernel.getPrecedesAttr());
  auto getStage = [](KernelOp of) {
    for (Operation &op : *of.getBodyBlock()) {
      if (auto bins = dyn_cast<BinsOp>(op))
        return bins.getStageAttr();
      if (auto bins = dyn_cast<OpenBinsOp>(op))
        return bins.getStageAttr();
    }
    return FlatSymbolRefAttr();
  };
  if (!next || next.getPrecedes() || !getStage(kernel) ||
      getStage(next) != getStage(kernel))
    return kernel.emitOpError("expected a 'piko.bins' of the same stage as in ")
           << kernel.getPrecedesAttr() << ", which precedes none";
  if (leavesInOrder(kernel))
    return kernel.emitOpError("expected neither emissions nor updates, because "
                              "it precedes another kernel");
  return success();
}

LogicalResult KernelOp::verifyRegions() {
  if (failed(verifyLevel(*this)))
    return failure();
  if (failed(verifyPrecedes(*this)))
    return failure();
  if (failed(verifyBarriers(*this)))
    return failure();
  if (getProcess() || getOps<AssignOp>().empty())
    return success();
  // Without a process phase the kernel places the primitives of one source.
  auto assigns = getOps<AssignOp>();
  if (!llvm::hasSingleElement(assigns) || !(*assigns.begin()).getSource())
    return emitOpError("expected a process phase, or the assign phase of one "
                       "source alone");
  return success();
}

LogicalResult piko::verifyStage(Operation *op, FlatSymbolRefAttr name) {
  if (lookupInPipeline<StageOp>(op, name))
    return success();
  return op->emitOpError("expected a stage, but got ")
         << name << ", which is none";
}

LogicalResult piko::verifyLocalEdge(Operation *op, FlatSymbolRefAttr from,
                                    int64_t port, FlatSymbolRefAttr to) {
  for (auto edge : getPipeline(op).getOps<EdgeOp>()) {
    if (edge.getProducerAttr() != from || edge.getPort() != port ||
        edge.getConsumerAttr() != to)
      continue;
    auto producer = lookupInPipeline<StageOp>(op, from);
    auto consumer = lookupInPipeline<StageOp>(op, to);
    if (!producer || !consumer)
      break; // the edge has an error
    if (producer.getBins() != consumer.getBins())
      return op->emitOpError("expected stages with bins of one size, but got ")
             << "[" << producer.getBins() << "] and [" << consumer.getBins()
             << "]";
    ScheduleOp schedule = consumer.getSchedule();
    if (!consumer.collects() && !(schedule && schedule.getAfter()))
      return op->emitOpError("expected a stage that waits for its bin, but ")
             << to << " does not";
    return success();
  }
  return op->emitOpError("expected an edge from port ")
         << port << " of " << from << " to " << to << ", but there is none";
}

LogicalResult LocalBarrierOp::verifySymbolUses(SymbolTableCollection &) {
  return verifyLocalEdge(*this, getProducerAttr(), getPort(),
                         getConsumerAttr());
}

LogicalResult BeginScheduleOp::verifySymbolUses(SymbolTableCollection &) {
  return verifyStage(*this, getStageAttr());
}

LogicalResult ScheduleBinOp::verifySymbolUses(SymbolTableCollection &) {
  return verifyStage(*this, getStageAttr());
}
