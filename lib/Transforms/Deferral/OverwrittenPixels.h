// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where a kernel overwrites pixels of which it sees nothing.

#ifndef PIKO_LIB_TRANSFORMS_OVERWRITTENPIXELS_H
#define PIKO_LIB_TRANSFORMS_OVERWRITTENPIXELS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// A place at which a primitive overwrites a pixel, of one image or of several.
struct Site {
  llvm::SmallVector<UpdateOp> updates; // in the order of the images
  mlir::ValueRange getCoordinates() const {
    return UpdateOp(updates.front()).getCoordinates();
  }
};

/// The places at which a kernel overwrites numbers of pixels that it does
/// not read: those of images that are overwritten together in one list.
llvm::SmallVector<llvm::SmallVector<Site>> findSites(mlir::Operation *kernel);

/// Whether a site in some work overwrites a pixel once for each bin.
bool overwritesOnce(mlir::Operation *work, const Site &site);

/// The work of a bin in which all sites are, or null.
mlir::Operation *findOverwritingWork(BinsOp bins, llvm::ArrayRef<Site> sites);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_OVERWRITTENPIXELS_H
