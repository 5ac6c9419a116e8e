// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loop flattening: two loops, one inside of the other, as one whose iterations
// are those of the inner loop, so that lanes which have ended it need not wait
// for those which have not.

#ifndef PIKO_LIB_TRANSFORMS_FLATTENLOOPS_H
#define PIKO_LIB_TRANSFORMS_FLATTENLOOPS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// A loop, and the only one that stands in it by itself.
struct FlatNest {
  mlir::Operation *outer = nullptr, *inner = nullptr;
  /// In how many of its iterations a lane is expected to go on to the next one
  /// of the outer loop, where lanes wait for others before they do; else all of
  /// them.
  std::optional<double> advances = std::nullopt;

  explicit operator bool() const { return outer; }
};

/// What `outer`, an scf.for or an scf.while, is a nest of. None where another
/// loop stands beside the inner one, or where what it keeps from iteration to
/// iteration is no number.
FlatNest findFlatNest(mlir::Operation *outer);

/// Replaces a nest by one loop that does the same in the same order. Each of
/// its iterations makes one of the inner loop, and, where that has ended, goes
/// on to the next iteration of the outer loop, up to the inner one.
mlir::scf::WhileOp flatten(FlatNest nest);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_FLATTENLOOPS_H
