// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where the CPU has tiles.

#ifndef PIKO_LIB_CONVERSION_PIKOTOSCF_TILES_H
#define PIKO_LIB_CONVERSION_PIKOTOSCF_TILES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Makes private arrays of tiles, with loops that fill them and write them
/// back; or leaves them where they are in their image, and clears that. Updates
/// have become loads and stores.
llvm::LogicalResult lowerTiles(PipelineOp pipeline, bool arePrivate);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOSCF_TILES_H
