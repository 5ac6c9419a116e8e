// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops that read or write one element after the other. Vectors along such a
// loop are loads and stores; vectors across it are gathers from as many lines
// of the cache as there are lanes.

#ifndef PIKO_LIB_TRANSFORMS_LOOPSTREAMS_H
#define PIKO_LIB_TRANSFORMS_LOOPSTREAMS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Whether an access to state, to an array or to an array field goes on by one
/// element from one iteration to the next.
bool isStream(mlir::Operation *access, mlir::scf::ForOp loop);

/// Whether an access is to the same elements in each iteration of a loop around
/// it, as far as is known: their lines of the cache are there from the first
/// one.
bool isRepeated(mlir::Operation *access, mlir::scf::ForOp loop);

/// Whether LLVM is expected to run iterations of an inner loop as vectors: they
/// have no control flow, access streams or what is the same for all, and carry
/// nothing but sums that may be reordered. A short loop in another is unrolled,
/// and becomes part of that one's iterations.
bool hasVectorsAlong(mlir::scf::ForOp loop);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LOOPSTREAMS_H
