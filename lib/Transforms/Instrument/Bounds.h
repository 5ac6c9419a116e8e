// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a phase may not exceed: the sizes of its arrays, and the trips of its
// loops.

#ifndef PIKO_LIB_TRANSFORMS_BOUNDS_H
#define PIKO_LIB_TRANSFORMS_BOUNDS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Puts each index into a local array or into an array of a field through a
/// `piko.check_index`, unless it is known to be inside.
void checkIndices(mlir::Operation *phase);

/// Makes each `scf.while` of a phase end when a `piko.check_trip` says so.
void checkTrips(mlir::Operation *phase);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_BOUNDS_H
