// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_ANALYSIS_REPEATABLE_H
#define PIKO_ANALYSIS_REPEATABLE_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Whether an operation gives the same value wherever it runs, as long as its
/// operands and the pipeline's constants are the same.
inline bool isRepeatable(mlir::Operation *op) {
  if (auto load = mlir::dyn_cast<LoadOp>(op))
    return bool(lookupInPipeline<ConstantOp>(op, load.getStateAttr()));
  return op->getNumRegions() == 0 && mlir::isMemoryEffectFree(op) &&
         mlir::isSpeculatable(op) && !mlir::isa<BinOp>(op);
}

} // namespace piko

#endif // PIKO_ANALYSIS_REPEATABLE_H
