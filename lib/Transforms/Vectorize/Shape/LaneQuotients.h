// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Tests of quotients, without the quotients.

#ifndef PIKO_LIB_TRANSFORMS_LANEQUOTIENTS_H
#define PIKO_LIB_TRANSFORMS_LANEQUOTIENTS_H

#include "Vectorize/Analysis/IterationLanes.h"

namespace piko {

/// Where an iteration goes on only if quotients by what all iterations share
/// are not negative, as barycentric coordinates are, tests their dividends in
/// front: vectors of which no lane goes on divide nothing.
void testDividends(mlir::scf::ForOp root);

/// Where lanes divide integers by what all share, and that is neither 0 nor -1,
/// no lane's dividend needs to be looked at.
void testDivisors(const IterationLanes &lanes);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANEQUOTIENTS_H
