// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Whether two iterations of a loop may access one pixel. Updates of a pixel
// keep the order of iterations; those whose pixels differ can be done at once.

#ifndef PIKO_ANALYSIS_ITERATIONPIXELS_H
#define PIKO_ANALYSIS_ITERATIONPIXELS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Whether no two iterations of a parallel loop, or primitives of work, update
/// one pixel: its coordinates say which iteration it is, or only one iteration
/// does. Numbers of iterations fit in 32 bits.
bool updatesOwnPixels(mlir::Operation *loop);

} // namespace piko

#endif // PIKO_ANALYSIS_ITERATIONPIXELS_H
