// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops of phases whose iterations are written in order, though none needs what
// another one did.

#ifndef PIKO_LIB_TRANSFORMS_SEQUENTIALLOOPS_H
#define PIKO_LIB_TRANSFORMS_SEQUENTIALLOOPS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Whether lanes should share the iterations of a loop, if their cost allows.
/// They may: iterations hand on nothing, read nothing that they change, and
/// change each field of state in one place, once in an iteration, where lanes
/// keep their order. And it is not known that the loop is short, or that LLVM
/// does it well.
bool mayRunInOrder(mlir::scf::ForOp loop, int64_t laneCount);

/// Stream compaction: a loop that finds which iterations of another one have
/// something to do, and one over these iterations.
struct Compaction {
  mlir::scf::ForOp strips; ///< around both, instead of the loop
  mlir::scf::ForOp finds, does;
};

/// Of a loop whose iterations do nothing but what stands under one condition,
/// which has a loop of its own; none of others.
std::optional<Compaction> compact(mlir::scf::ForOp loop);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_SEQUENTIALLOOPS_H
