// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops in whose iterations lanes read elements side by side.

#ifndef PIKO_LIB_TRANSFORMS_RUNLOOPS_H
#define PIKO_LIB_TRANSFORMS_RUNLOOPS_H

#include "mlir/IR/Operation.h"

namespace piko {

/// Unrolls innermost loops of a kernel in which lanes gather an element each
/// iteration, and the next one in the next iteration, so that these gathers
/// stand in one block. How often the loops iterate is known, and is not much.
void unrollRuns(mlir::Operation *kernel);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_RUNLOOPS_H
