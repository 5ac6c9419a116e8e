// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Pointer chasing: loads whose place a load of the iteration before says, as
// those of nodes that a traversal takes off its stack. One iteration waits for
// each of them; lanes wait together.

#ifndef PIKO_LIB_TRANSFORMS_LOADCHAINS_H
#define PIKO_LIB_TRANSFORMS_LOADCHAINS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// The innermost loop around a load for which where it reads depends on what
/// the loop has read in iterations before, by way of what it hands on or of
/// arrays that it changes; null if there is none. A loop inside of it that
/// begins at such a place goes on from there by itself.
mlir::Operation *findChase(LoadOp load);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LOADCHAINS_H
