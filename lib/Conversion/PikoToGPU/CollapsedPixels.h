// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Pixels of many primitives as one space that threads share.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_COLLAPSEDPIXELS_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_COLLAPSEDPIXELS_H

#include "PixelNest.h"

namespace piko {

/// Spreads the pixels of the boxes of a group of primitives over the threads of
/// a block, and gives the rare ones to all of them. Fails with an error where
/// it cannot; the kernel is then of no use.
llvm::LogicalResult collapsePixels(mlir::scf::ForOp items, PixelNest &nest,
                                   StageOp stage, const ThreadTile &tile,
                                   GridMemory &memory, SharingCounts &counts);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_COLLAPSEDPIXELS_H
