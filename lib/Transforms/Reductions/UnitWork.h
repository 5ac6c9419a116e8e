// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a kernel does in a unit of work.

#ifndef PIKO_LIB_TRANSFORMS_UNITWORK_H
#define PIKO_LIB_TRANSFORMS_UNITWORK_H

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// The writer of what a kernel's stage emits, in the loop over its units, or
/// null: a source's kernel changes no state.
inline OpenWriterOp findUnitWriter(KernelOp kernel) {
  for (auto units : kernel.getOps<mlir::scf::ForallOp>())
    for (auto open : units.getOps<OpenWriterOp>()) {
      auto bins = open.getBins().getDefiningOp<OpenBinsOp>();
      if (!open.getStageAttr() && bins && !bins.getSource())
        return open;
    }
  return {};
}

/// Whether a primitive, or a call that takes a list, does it in a loop of its
/// own: around it are the loops over units, over cells or calls, and over
/// primitives.
inline bool isRepeatedInWork(mlir::Operation *op) {
  int64_t depth = 0;
  for (mlir::Operation *at = op->getParentOp();
       !mlir::isa<mlir::scf::ForallOp>(at); at = at->getParentOp())
    depth += mlir::isa<mlir::LoopLikeOpInterface>(at);
  return depth > 2;
}

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_UNITWORK_H
