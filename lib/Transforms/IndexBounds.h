// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which indices lie in [0, n), where n is the extent of a piece of state or the
// size of a list.

#ifndef PIKO_LIB_TRANSFORMS_INDEXBOUNDS_H
#define PIKO_LIB_TRANSFORMS_INDEXBOUNDS_H

#include "mlir/Dialect/Arith/IR/Arith.h"

#include "llvm/ADT/DenseSet.h"

namespace piko {

/// The value without casts that leave every number as it is.
mlir::Value stripWidening(mlir::Value value);

/// Proves at one place of a phase that a value is an index below a bound, from
/// loops, conditions, minimum and maximum. What is said of i32 holds for
/// numbers as they are, after they have wrapped around.
class IndexBounds {
public:
  /// `isBound` says whether a value is the bound, as an index; it is never
  /// negative.
  IndexBounds(llvm::function_ref<bool(mlir::Value)> isBound,
              mlir::Operation *at)
      : isBound(isBound), at(at) {}

  bool contains(mlir::Value value) {
    return isNonNegative(value) && isBelow(value);
  }
  bool isNonNegative(mlir::Value value);

private:
  /// Whether the value is below the bound unless it is negative.
  bool isBelow(mlir::Value value);
  bool isAtMost(mlir::Value value);
  bool isBoundItself(mlir::Value value);
  /// Whether arguments of loops are at least 0, or below the bound.
  bool isNonNegativeArgument(mlir::BlockArgument argument);
  bool isBelowArgument(mlir::BlockArgument argument);
  /// Whether a comparison that holds at this place says so.
  bool isGuarded(mlir::Value value, bool below);
  bool isGuardedHere(mlir::Value value, bool below);
  /// Whether the condition, if it is as `truth` says, says so.
  bool holds(mlir::Value condition, bool truth, mlir::Value value, bool below);
  bool holds(mlir::arith::CmpIPredicate predicate, mlir::Value right,
             bool below);

  llvm::function_ref<bool(mlir::Value)> isBound;
  mlir::Operation *at;
  /// Values that a proof by induction assumes not to be negative. Such a proof
  /// is about earlier turns of a loop, too, and cannot use what holds only at
  /// this place.
  llvm::SmallDenseSet<mlir::Value> assumed;
  /// What conditions are being asked about: a bound may be made of the value.
  llvm::SmallDenseSet<std::pair<mlir::Value, unsigned>> asked;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_INDEXBOUNDS_H
