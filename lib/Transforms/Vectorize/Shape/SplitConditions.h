// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Conditions around loops, split where the loops stand.

#ifndef PIKO_LIB_TRANSFORMS_SPLITCONDITIONS_H
#define PIKO_LIB_TRANSFORMS_SPLITCONDITIONS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Brings a loop that tests a flag (RotateLoops) out of the scf.ifs that it
/// stands under, up to a block. Where they go past it, its flag is false.
void split(mlir::scf::WhileOp loop, mlir::Block *body);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_SPLITCONDITIONS_H
