// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Numbers that nobody has written, followed to where they are emitted or
// stored.

#ifndef PIKO_LIB_TRANSFORMS_UNWRITTEN_H
#define PIKO_LIB_TRANSFORMS_UNWRITTEN_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Puts a `piko.check_value unwritten` before each emission, store and end of
/// an update for each of its numbers that may be unwritten, and makes every
/// `piko.undefined` of the phase 0. `hostOf` gives the record that a message
/// names.
void checkUnwritten(
    mlir::Operation *phase,
    llvm::function_ref<mlir::FlatSymbolRefAttr(mlir::FlatSymbolRefAttr)>
        hostOf);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_UNWRITTEN_H
