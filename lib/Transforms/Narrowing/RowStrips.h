// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Strip-mining and interchange of loops over the pixels of a convex shape:
// strips of columns, and of each the rows that it may have.

#ifndef PIKO_LIB_TRANSFORMS_ROWSTRIPS_H
#define PIKO_LIB_TRANSFORMS_ROWSTRIPS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Pixels where base + row step * row + column step * column is not negative,
/// or where it is, if `isNegative`: in 32 bits, which hold the sum at each
/// pixel of the loops. Null stands for 0. All are from before the loops.
struct HalfPlane {
  mlir::Value base, rowStep, columnStep;
  bool isNegative = false;
};

/// Whether loops over rows and the columns of each, both of step one, may be
/// interchanged: each pixel may come at any time, and changes nothing but what
/// is its own. The loop over rows carries nothing but affine functions of the
/// row.
bool canInterchange(mlir::scf::ForOp rows, mlir::scf::ForOp columns);

/// Makes a loop over strips of so many columns around both, in which those rows
/// are left that have a pixel in all half-planes; others have nothing to do.
/// The rows of `group` strips are found at once.
void interchange(mlir::scf::ForOp rows, mlir::scf::ForOp columns,
                 llvm::ArrayRef<HalfPlane> planes, int64_t width,
                 int64_t group);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_ROWSTRIPS_H
