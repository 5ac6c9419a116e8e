// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Tests of quotients, without the quotients.

#ifndef PIKO_LIB_TRANSFORMS_LANEQUOTIENTS_H
#define PIKO_LIB_TRANSFORMS_LANEQUOTIENTS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Where a turn goes on only if quotients by what all turns share are not
/// negative, as barycentric coordinates are, tests their dividends in front:
/// vectors of which no lane goes on divide nothing.
void testDividends(mlir::scf::ForOp root);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANEQUOTIENTS_H
