// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which loops lanes may share, and what vectors of lanes are.

#ifndef PIKO_LIB_TRANSFORMS_LANES_H
#define PIKO_LIB_TRANSFORMS_LANES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// The type of a vector of so many of these numbers, or of the addresses of
/// primitives.
mlir::VectorType getVectorType(mlir::Type type, int64_t laneCount);

/// Whether a loop of a kernel is over the primitives of a cell.
bool isOverPrimitives(mlir::scf::ForOp loop);

/// The phase that a loop over primitives runs: "process" or "assignBin".
llvm::StringRef getLoopPhase(mlir::scf::ForOp loop);

/// What the lanes of a loop over primitives are given, if that is known.
std::optional<LaneMapping> getLaneMapping(mlir::scf::ForOp loop);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANES_H
