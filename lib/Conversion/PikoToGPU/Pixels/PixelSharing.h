// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Threads that share the pixels of one primitive after the other.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_PIXELSHARING_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_PIXELSHARING_H

#include "PikoToGPU/Grid/GridMemory.h"
#include "PikoToGPU/Mapping/PixelOwners.h"

namespace piko {

/// Leaves to each thread the updates of its own pixels, and what follows from
/// them, in a loop over primitives that all threads run. An error where
/// findObstacleToSharing finds one.
llvm::LogicalResult sharePixels(mlir::scf::ForOp items, const ThreadTile &tile);

/// Lets each thread of a block compute what depends on a primitive alone for
/// another one, in groups of as many as there are threads, in a loop whose
/// pixels they share.
void shareSetup(mlir::scf::ForOp items, const ThreadTile &tile,
                GridMemory &memory);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_PIXELSHARING_H
