// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What operations that access fields verify alike.

#ifndef PIKO_LIB_DIALECT_PIKO_IR_FIELDACCESS_H
#define PIKO_LIB_DIALECT_PIKO_IR_FIELDACCESS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Checks that constant indices, of an access that verifyFieldAccess() has
/// checked, are within an array field where a stage's phase does the access
/// without a condition; reports at `op` where not.
mlir::LogicalResult verifyElement(mlir::Operation *op,
                                  mlir::FlatSymbolRefAttr record,
                                  llvm::StringRef field,
                                  mlir::ValueRange indices);

} // namespace piko

#endif // PIKO_LIB_DIALECT_PIKO_IR_FIELDACCESS_H
