// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Pixels of many primitives as one space that threads share.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_COLLAPSEDPIXELS_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_COLLAPSEDPIXELS_H

#include "PikoToGPU/Grid/GridMemory.h"
#include "PikoToGPU/Mapping/PixelNest.h"
#include "PikoToGPU/Mapping/PixelOwners.h"

namespace piko {

/// Where a kernel takes the primitives of a bucket in groups, and comes to a
/// rare one.
struct RareSite {
  RestOp rest;            ///< What a launch before has left of the unit.
  mlir::Value isLeft;     ///< Whether that is something.
  mlir::Value begin, end; ///< The bucket's positions.
  mlir::scf::WhileOp groups;
  mlir::scf::IfOp branch; ///< What is done with a rare primitive ...
  mlir::Value position;   ///< ... which is here,
  mlir::Operation *next;  ///< and where the next group begins: a select.
};

/// Spreads the pixels of the boxes of a group of primitives over the threads of
/// a block, and gives the rare ones to all of them. Fails with an error where
/// it cannot; the kernel is then of no use.
llvm::FailureOr<RareSite> collapsePixels(mlir::scf::ForOp items,
                                         PixelNest &nest, StageOp stage,
                                         const ThreadTile &tile,
                                         GridMemory &memory);

/// Puts a launch before the kernel's that leaves each unit to that where
/// its first rare primitive stands. So what these need, which is called, takes
/// no registers of the first one.
void leaveRareToSecondLaunch(RareSite site, mlir::gpu::LaunchOp second);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_COLLAPSEDPIXELS_H
