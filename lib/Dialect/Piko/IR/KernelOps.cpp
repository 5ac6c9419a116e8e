// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Kernels and the storage of bins.

#include "Piko/Dialect/Piko/IR/Piko.h"

using namespace mlir;
using namespace piko;

ProcessOp KernelOp::getProcess() {
  for (auto process : getOps<ProcessOp>())
    return process;
  return {};
}

LogicalResult KernelOp::verifyRegions() {
  bool hasPhase = false, hasOther = false;
  int processes = 0;
  for (Operation &op : *getBodyBlock()) {
    (isa<AssignOp, ProcessOp>(op) ? hasPhase : hasOther) = true;
    processes += isa<ProcessOp>(op);
  }
  if (hasPhase && hasOther)
    return emitOpError("expected phases (the kernels level) or loops (the "
                       "resolved level), but got both");
  if (processes > 1)
    return emitOpError("expected at most one process phase, but got ")
           << processes;
  if (!hasPhase || processes)
    return success();
  // Without a process phase the kernel places the primitives of one source.
  auto assigns = getOps<AssignOp>();
  if (!llvm::hasSingleElement(assigns) || !(*assigns.begin()).getSource())
    return emitOpError("expected a process phase, or the assign phase of one "
                       "source alone");
  return success();
}

LogicalResult OpenBinsOp::verifySymbolUses(SymbolTableCollection &) {
  auto stage = lookupInPipeline<StageOp>(*this, getStageAttr());
  if (!stage)
    return emitOpError("expected a stage, but got ")
           << getStageAttr() << ", which is none";
  if (stage.getInputAttr() != getBins().getType().getRecord())
    return emitOpError("expected bins of record ")
           << stage.getInputAttr() << ", but got "
           << getBins().getType().getRecord();
  return success();
}
