// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Starts from the iteration's number and marks all that follows from it, until
// nothing is added.

#include "Uniformity.h"

#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

using namespace mlir;
using namespace piko;

bool piko::isBarrier(Operation *op) { return isa<BarrierOpInterface>(op); }

Operation *piko::findBarrier(Operation *op) {
  Operation *found = nullptr;
  op->walk<WalkOrder::PreOrder>([&](Operation *inner) {
    if (isa<ParallelLoopOpInterface>(inner))
      return WalkResult::skip();
    if (!isBarrier(inner))
      return WalkResult::advance();
    found = inner;
    return WalkResult::interrupt();
  });
  return found;
}

Uniformity::Uniformity(ParallelForOp loop) {
  if (auto kernel = loop->getParentOfType<KernelOp>())
    kernel.walk([&](Operation *op) {
      if (isa<StoreOp, AtomicOp>(op))
        written.insert(op->getAttr("state"));
      else if (auto update = dyn_cast<UpdateOp>(op))
        written.insert(update.getImageAttr());
    });
  varying.insert(loop.getIteration());
  for (bool changed = true; changed;) {
    changed = false;
    loop->walk<WalkOrder::PreOrder>([&](Operation *op) {
      if (op != loop)
        changed |= visit(op);
    });
  }
}

bool Uniformity::flow(ValueRange sources, ValueRange targets,
                      bool alsoVarying) {
  bool changed = false;
  for (auto [source, target] : llvm::zip(sources, targets))
    changed |= mark(target, alsoVarying || isVarying(source));
  return changed;
}

bool Uniformity::visitControlFlow(Operation *op) {
  // Iterations that meet inside are compared; others may part ways.
  bool parts = !findBarrier(op);
  if (auto loop = dyn_cast<scf::ForOp>(op)) {
    Value lower = loop.getLowerBound(), step = loop.getStep();
    parts &= anyVarying({lower, loop.getUpperBound(), step});
    bool changed =
        mark(loop.getInductionVar(), isVarying(lower) || isVarying(step));
    for (ValueRange targets : {ValueRange(loop.getRegionIterArgs()),
                               ValueRange(loop.getResults())}) {
      changed |= flow(loop.getInitArgs(), targets, parts);
      changed |= flow(loop.getYieldedValues(), targets, parts);
    }
    return changed;
  }
  if (auto loop = dyn_cast<scf::WhileOp>(op)) {
    parts &= isVarying(loop.getConditionOp().getCondition());
    bool changed = flow(loop.getInits(), loop.getBeforeArguments(), parts);
    changed |=
        flow(loop.getYieldOp().getOperands(), loop.getBeforeArguments(), parts);
    ValueRange leaving = loop.getConditionOp().getArgs();
    changed |= flow(leaving, loop.getAfterArguments(), parts);
    return flow(leaving, loop.getResults(), parts) || changed;
  }
  // scf.if, scf.index_switch
  parts &= anyVarying(op->getOperands());
  bool changed = false;
  for (Region &region : op->getRegions())
    if (!region.empty())
      changed |= flow(region.front().getTerminator()->getOperands(),
                      op->getResults(), parts);
  return changed;
}

bool Uniformity::visit(Operation *op) {
  if (isa<scf::ForOp, scf::WhileOp, scf::IfOp, scf::IndexSwitchOp>(op))
    return visitControlFlow(op);
  if (isa<ReduceOp>(op))
    return false;
  bool differs = anyVarying(op->getOperands());
  if (auto load = dyn_cast<LoadOp>(op))
    differs |= written.contains(load.getStateAttr());
  else if (op->getNumRegions() != 0 || isa<ScanOp, SortOp>(op))
    differs = true;
  else if (!isMemoryEffectFree(op) && !isa<ListAtOp>(op))
    differs = true;
  bool changed = false;
  for (Value result : op->getResults())
    changed |= mark(result, differs);
  return changed;
}

/// Whether an operation without operands gives the same value everywhere.
static bool isConstant(Operation *op) {
  if (op->getNumOperands() != 0 || op->getNumRegions() != 0 ||
      op->getNumResults() == 0)
    return false;
  if (auto load = dyn_cast<LoadOp>(op))
    return bool(lookupInPipeline<ConstantOp>(op, load.getStateAttr()));
  return isMemoryEffectFree(op) && isSpeculatable(op);
}

ParallelForOp piko::hoistInvariants(ParallelForOp parallel) {
  parallel.walk([&](Operation *op) {
    if (isConstant(op))
      op->moveBefore(parallel);
  });
  moveLoopInvariantCode(
      &parallel.getBody(),
      [&](Value value, Region *region) {
        return !region->isAncestor(value.getParentRegion());
      },
      [&](Operation *op, Region *) {
        return isMemoryEffectFree(op) && isSpeculatable(op);
      },
      [&](Operation *op, Region *) { op->moveBefore(parallel); });
  return parallel;
}
