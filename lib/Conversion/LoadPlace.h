// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where a load takes registers for no longer than it saves loads.

#ifndef PIKO_LIB_CONVERSION_LOADPLACE_H
#define PIKO_LIB_CONVERSION_LOADPLACE_H

#include "mlir/IR/Operation.h"

namespace piko {

/// Before what `user`'s operand is to be loaded: of the outermost loop in
/// `around` that has no loop in its body but those around the user. Before
/// a loop that has, the number would be kept over one that does not need it.
mlir::Operation *findLoadPlace(mlir::Operation *user, mlir::Operation *around);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_LOADPLACE_H
