// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops that count, written with a condition.

#ifndef PIKO_LIB_TRANSFORMS_COUNTEDWHILES_H
#define PIKO_LIB_TRANSFORMS_COUNTEDWHILES_H

#include "mlir/Dialect/SCF/IR/SCF.h"

#include <optional>

namespace piko {

/// How a loop counts by one: which of its variables, below which bound, and
/// whether it takes the bound as well.
struct CountedWhile {
  unsigned variable = 0;
  mlir::Value bound;
  bool isClosed = false;
};

std::optional<CountedWhile> findCountedWhile(mlir::scf::WhileOp loop);

mlir::scf::ForOp countLoop(mlir::scf::WhileOp loop,
                           const CountedWhile &counting);

/// Makes loops that count of those inside of which one knows how often they
/// iterate, in 64 bits.
void countLoops(mlir::scf::ForOp root);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_COUNTEDWHILES_H
