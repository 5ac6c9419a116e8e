// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Who runs the stages of a program that several ranks run together.

#ifndef PIKO_LIB_TRANSFORMS_RANKS_PARTITION_H
#define PIKO_LIB_TRANSFORMS_RANKS_PARTITION_H

#include "Piko/Dialect/Piko/IR/PikoProgram.h"

namespace piko {

struct StageDivision {
  RankDivision division = RankDivision::First;
  RankOwners owners = RankOwners::Pattern;
};

/// By stage.
using Divisions = llvm::DenseMap<mlir::Operation *, StageDivision>;

/// Whether an access to state is to pixels of the call's bin.
bool isInBin(mlir::Operation *access);

/// Whether bins of both stages that are at one place have one owner.
bool haveSameOwners(StageOp a, StageOp b, const Divisions &divisions);

/// Puts the statements of strips in place of these; gives the first one.
mlir::Operation *takeApart(StripsOp strips);

/// Puts `piko.keep`, `piko.share` and `piko.common` into a program where ranks
/// use state that others have written. Takes strips apart that would share
/// state from one to the next.
void shareState(ProgramOp program, const Divisions &divisions);

//===----------------------------------------------------------------------===//
// What costs less: to compute, or to send (TransferCost.cpp)
//===----------------------------------------------------------------------===//

/// Whether each rank computes what a kernel stores in less time than it takes
/// to bring it there from the rank that has computed it.
bool isCheaperThanItsStores(KernelOp kernel);

/// The same of the bins that the AssignBin of a source finds.
bool isCheaperThanItsBins(KernelOp kernel);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_RANKS_PARTITION_H
