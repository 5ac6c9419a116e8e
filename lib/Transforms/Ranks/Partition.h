// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Who runs the stages of a program that several ranks run together.

#ifndef PIKO_LIB_TRANSFORMS_RANKS_PARTITION_H
#define PIKO_LIB_TRANSFORMS_RANKS_PARTITION_H

#include "Piko/Dialect/Piko/IR/PikoProgram.h"

namespace piko {

enum class Division {
  First, ///< The first rank alone.
  Parts, ///< Each rank what it has been fed, or has emitted.
  Bins   ///< Each rank the bins that it owns.
};

/// By stage.
using Divisions = llvm::DenseMap<mlir::Operation *, Division>;

/// Puts `piko.keep` and `piko.share` into a program where ranks use state that
/// others have written.
void shareState(ProgramOp program, const Divisions &divisions);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_RANKS_PARTITION_H
