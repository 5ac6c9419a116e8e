// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Affine functions of the pixel, in a loop over the pixels of a row and the
// loop over rows around it; and tests before the loops of what values such
// functions have in them.

#ifndef PIKO_LIB_TRANSFORMS_AFFINENEST_H
#define PIKO_LIB_TRANSFORMS_AFFINENEST_H

#include "mlir/Dialect/SCF/IR/SCF.h"

#include <array>

namespace piko {

/// base + coefficients[i] * variable i, modulo 2^64; null for 0. All of these
/// numbers have 64 bits.
struct Affine {
  mlir::Value base;
  std::array<mlir::Value, 2> coefficients;
};

/// A loop over the pixels of a row and, if there is one, the loop over rows.
/// What it makes stands before both.
class AffineNest {
public:
  explicit AffineNest(mlir::scf::ForOp row);

  mlir::scf::ForOp getRow() const { return row; }
  mlir::scf::ForOp getOuter() const { return outer; }
  /// From outside.
  llvm::ArrayRef<mlir::scf::ForOp> getLoops() const { return loops; }

  bool isInvariant(mlir::Value value) const {
    return !outer->isAncestor(value.getParentRegion()->getParentOp());
  }
  /// Whether a number of 32 or 64 bits is a function that `expand` knows.
  bool isAffine(mlir::Value value);

  /// Of 32 bits, the number itself if that has as many: see `addCheck`.
  Affine expand(mlir::Value value);
  Affine subtract(Affine a, const Affine &b);
  /// Without the bits that all coefficients have as 0, and without those of the
  /// base: the function divided by a power of two, and rounded down, which has
  /// the same sign. Returns how many bits.
  unsigned shiftDown(Affine &affine);

  /// What a function is at least and at most where no test failed.
  struct Range {
    mlir::Value least, most;
  };
  /// Extends a test, null at first, by whether a function fits into 32 bits at
  /// the corners of the loops' domain, hence at all pixels; and those of 32
  /// bits that others were expanded from, which do not overflow then.
  Range addCheck(const Affine &affine, mlir::Value &fits);
  /// Extends a test by whether a number has so many bits, with its sign.
  void require(mlir::Value value, int bits, mlir::Value &fits);

  mlir::Value makeConstant(int64_t value);
  /// The sum or the difference of two, of which null is 0.
  mlir::Value getTwo(bool isSum, mlir::Value a, mlir::Value b);

  mlir::OpBuilder builder;
  mlir::Location loc;

private:
  bool isVariable(mlir::Value value);
  bool computeIsAffine(mlir::Value value);
  Affine computeExpansion(mlir::Value value);
  Affine expandArgument(mlir::BlockArgument argument);
  /// A signed number in 64 bits.
  mlir::Value extend(mlir::Value number);

  mlir::scf::ForOp row, outer;
  llvm::SmallVector<mlir::scf::ForOp, 2> loops;
  // What is known of values, which may be used more than once.
  llvm::DenseMap<mlir::Value, bool> affine;
  llvm::DenseMap<mlir::Value, Affine> expanded;
  /// Functions of 32 bits that are extended, and not yet tested.
  llvm::SmallVector<Affine> assumed;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_AFFINENEST_H
