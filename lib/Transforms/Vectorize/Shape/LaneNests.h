// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Nests of loops in which lanes need not wait for one another.

#ifndef PIKO_LIB_TRANSFORMS_LANENESTS_H
#define PIKO_LIB_TRANSFORMS_LANENESTS_H

#include "Vectorize/Analysis/IterationLanes.h"

namespace piko {

/// A copy of a loop that lanes may share, with nests of its iterations
/// flattened.
struct FlatLoop {
  mlir::scf::ForOp loop = nullptr; ///< Null if nothing is gained.
  IterationLanes::Cost cost = IterationLanes::Cost();
  llvm::SmallVector<mlir::Location> nests = {};
  /// Others, which lanes go through one after the other, since an order shows.
  llvm::SmallVector<mlir::Location> ordered = {};
  /// Whether lanes elect what they do in each turn.
  bool isMerged = false;
  /// By which its primitives are to be counted by themselves.
  llvm::SmallVector<mlir::Value> writers = {};
};

/// Counts all primitives of a loop before where it stands.
void countPrimitives(mlir::scf::ForOp loop, mlir::ValueRange writers);

/// Flattens each nest whose inner loop lanes leave at different times, where
/// that is expected to take less, and nothing of it is done in an order that
/// shows; then iterations, each with its only loop. Or merges a whole nest,
/// where that is expected to take no more than `mergeGain` of what else does.
FlatLoop flattenNests(const IterationLanes &lanes, double mergeGain);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANENESTS_H
