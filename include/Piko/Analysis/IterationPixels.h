// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Whether two iterations of a loop may access one pixel. Updates of a pixel
// keep the order of iterations; those whose pixels differ can be done at once.

#ifndef PIKO_ANALYSIS_ITERATIONPIXELS_H
#define PIKO_ANALYSIS_ITERATIONPIXELS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Of a loop that keeps its text meanwhile, and what counts its iterations:
/// numbers that 32 bits hold.
class IterationPixels {
public:
  IterationPixels(mlir::Operation *loop, mlir::ValueRange counters)
      : loop(loop), counters(counters.begin(), counters.end()) {}

  /// Whether coordinates say which iteration it is, so that no two iterations
  /// have one pixel: each counter is one of them but for casts and for what is
  /// the same in all iterations, or they hold its quotient and its remainder.
  bool areOwn(mlir::ValueRange coordinates) const;

  /// The one iteration that reaches an operation in the loop, or null: a test
  /// of its number stands around it.
  mlir::Value findOnly(mlir::Operation *op) const;

  /// Whether what two operations access may be one pixel in one iteration
  /// alone, if that holds for `a`.
  bool agree(mlir::Operation *a, mlir::ValueRange pixelOfA, mlir::Operation *b,
             mlir::ValueRange pixelOfB) const;

private:
  bool isInvariant(mlir::Value value) const;
  mlir::Value getRoot(mlir::Value value) const;
  bool determine(llvm::ArrayRef<mlir::Value> roots, mlir::Value value,
                 int depth = 0) const;

  mlir::Operation *loop;
  llvm::SmallVector<mlir::Value, 2> counters;
};

/// Whether no two iterations of a parallel loop, or primitives of work, update
/// one pixel.
bool updatesOwnPixels(mlir::Operation *loop);

} // namespace piko

#endif // PIKO_ANALYSIS_ITERATIONPIXELS_H
