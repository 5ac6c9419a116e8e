// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What passes expect of texts that do not say it: how often loops iterate, how
// likely sides of conditions are, how many lanes are at work. All that estimate
// ask here, so that two of them agree about a loop. Likelihoods and hints that
// a text does have are in BranchProbability.h; what processors take, in
// TargetModel.h and lib/Transforms/Vectorize/Cost.

#ifndef PIKO_ANALYSIS_EXPECTATIONS_H
#define PIKO_ANALYSIS_EXPECTATIONS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

#include <optional>

namespace piko {

//===----------------------------------------------------------------------===//
// Loops
//===----------------------------------------------------------------------===//

namespace expected {

/// Iterations of a loop of which nothing is known; of one whose number of
/// iterations differs from lane to lane.
constexpr int64_t iterations = 8, differingIterations = 4;

/// Iterations of a parallel loop: as many as a bin of 8 x 8 has pixels; of the
/// longest one that a block of threads meets.
constexpr int64_t parallelIterations = 64, longestIterations = 256;

/// Bins of a stage that has the whole domain: of 64 x 64 pixels.
constexpr int64_t binExtent = 64;

/// A number that differs is taken to be a quarter of the largest: as often one
/// sees a few long loops and many short ones as all alike.
constexpr int64_t longestToMean = 4;

/// How many lanes are at work, in the mean, in a loop that each goes through by
/// itself.
constexpr double fullness = 0.85;

/// How often primitives of a bin overwrite a pixel, in the mean.
constexpr int64_t overwrites = 2;

} // namespace expected

/// How many iterations a loop has that counts up to a constant, or to a
/// constant above where it begins, but for sums that wrap.
std::optional<int64_t> getConstantIterations(mlir::scf::ForOp loop);

/// How often a loop iterates: by its constants, or by how probable the text
/// says it is that it goes on. Nothing where neither is known.
std::optional<double> getExpectedIterations(mlir::Operation *loop);

//===----------------------------------------------------------------------===//
// Conditions
//===----------------------------------------------------------------------===//

namespace expected {

/// How often a side runs that stands alone, one of two alike, and one that is
/// hardly ever taken.
constexpr double loneSide = 0.8, eitherSide = 0.5, rareSide = 0.001;

/// Operations of code that does next to nothing.
constexpr int64_t fewOperations = 16;

/// One that does so many times as much as the other is the rare one.
constexpr int64_t rareToUsual = 2;

} // namespace expected

/// Whether a side of a condition has no more than a few operations.
bool doesNextToNothing(mlir::Region &side);

/// Whether a side does much more than the other one, which does something, too:
/// that is how a rare case is written.
bool isMuchLonger(mlir::Region &side, mlir::Region &other);

} // namespace piko

#endif // PIKO_ANALYSIS_EXPECTATIONS_H
