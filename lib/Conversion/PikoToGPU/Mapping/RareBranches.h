// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Branches that few primitives take. In line one would cost all of them its
// registers, and memory of the thread's own.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_RAREBRANCHES_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_RAREBRANCHES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// The rare ways of the conditions in a loop, the outermost ones.
llvm::SmallVector<mlir::Region *> findRareWays(mlir::Operation *loop);

/// Whether the parallel loops of a loop over primitives are all in rare
/// branches, and there are such branches: who takes what does not depend on
/// those loops, which are the thread's.
bool hasRareIterationsOnly(mlir::Operation *loop);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_RAREBRANCHES_H
