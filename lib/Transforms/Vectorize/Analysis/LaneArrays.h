// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Arrays in records, as lanes read them.

#ifndef PIKO_LIB_TRANSFORMS_LANEARRAYS_H
#define PIKO_LIB_TRANSFORMS_LANEARRAYS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Where lanes read different elements of a short array in a field, as the
/// components of a corner, each is read, and a lane chooses: there is no gather
/// within an element.
void readAllElements(mlir::scf::ForOp root);

/// Where loops read elements of an array in the lanes' primitives again and
/// again, they are gathered once, into a private array with a row for each.
void copyItemArrays(mlir::scf::ForOp root);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANEARRAYS_H
