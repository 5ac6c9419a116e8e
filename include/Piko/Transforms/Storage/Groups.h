// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What piko.grouped becomes: iterations leave the number of their group, are
// sorted by it, and each group is run where its first iteration stands.

#ifndef PIKO_TRANSFORMS_STORAGE_GROUPS_H
#define PIKO_TRANSFORMS_STORAGE_GROUPS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// The number of an iteration's group, -1 where it is in none. That updates are
/// in their bin is tested here, so that what is outside is reported in the
/// order of iterations.
mlir::Value createGroup(mlir::OpBuilder &builder, GroupedOp op,
                        mlir::ValueRange key);

/// A loop over the ranks of iterations, no two iterations of which update one
/// pixel: where a group begins, its iterations run one after the other.
/// `groups` has the number of each iteration's group, `ranks` the iterations as
/// they are sorted; `values` are arrays for the arguments of the body.
mlir::scf::ForOp createGroupLoop(mlir::OpBuilder &builder, GroupedOp op,
                                 mlir::Value count, mlir::Value groups,
                                 mlir::Value ranks, mlir::ValueRange values,
                                 mlir::ValueRange results);

} // namespace piko

#endif // PIKO_TRANSFORMS_STORAGE_GROUPS_H
