// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How often the sides of a condition run, where nothing but their text says so.
//
// Loops on one side of a condition, in place of nothing, may be a slow path, as
// clipping is, where code goes on after it. How often it runs is not known:
// estimates are geometric means of those with it and without it. Of more than
// two guards in a row, each in the other, none after the second is taken to let
// fewer through.

#ifndef PIKO_LIB_TRANSFORMS_VECTORIZE_COST_BRANCHFREQUENCY_H
#define PIKO_LIB_TRANSFORMS_VECTORIZE_COST_BRANCHFREQUENCY_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// How often code runs, for each time that the loop's lanes do.
struct Frequency {
  double serial = 1, vectors = 1;

  Frequency scaled(double bySerial, double byVectors) const {
    return {serial * bySerial, vectors * byVectors};
  }
};

/// Whether a program that is right does not come here.
bool fails(mlir::Region &region);

/// How often a side of a condition runs, where lanes differ: mostly, if it
/// stands alone; hardly ever, if it does much more than the other, which does
/// something, too.
Frequency getFrequency(mlir::Region &side, mlir::Region &other,
                       int64_t laneCount);

/// Whether a condition is one more of those that all have to hold: it is all
/// that one around it does, in place of next to nothing.
bool isNextGuard(mlir::scf::IfOp choice);

/// Whether a side may be a slow path, as clipping is: it has loops, in place of
/// next to nothing, and what follows is for both. Nothing says how often it
/// runs.
bool mayBeSlowPath(mlir::scf::IfOp choice, mlir::Region &side,
                   mlir::Operation *loop);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_VECTORIZE_COST_BRANCHFREQUENCY_H
