// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_ANALYSIS_BRANCHPROBABILITY_H
#define PIKO_ANALYSIS_BRANCHPROBABILITY_H

#include "mlir/Dialect/ControlFlow/IR/ControlFlowOps.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/PatternMatch.h"

#include <optional>

namespace piko {

/// How probable it is that a branch goes into one of its regions, from 0 to 1,
/// where the text says so.
std::optional<double> getProbability(mlir::scf::IfOp branch,
                                     mlir::Region &region);
std::optional<double> getProbability(mlir::scf::IndexSwitchOp choice,
                                     mlir::Region &region);
/// The same of a branch that goes to its first block.
std::optional<double> getProbability(mlir::cf::CondBranchOp branch);

/// How probable it is that a loop goes on for another iteration.
std::optional<double> getIterationProbability(mlir::Operation *loop);
/// How often a loop iterates that goes on as probably as the text says, each
/// time alike: a geometric distribution.
std::optional<double> getProbableIterations(mlir::Operation *loop);

/// How many operations an operation or a region holds, itself among them, but
/// for what is known to run less often than once in 100,000 times: it takes no
/// time, and is there twice where lanes vote.
int64_t countOperations(mlir::Operation *op);
int64_t countOperations(mlir::Region &region);

/// Sets how probable it is that an scf.if takes its first side, or that a loop
/// goes on; forgets it where that is not known.
void setProbability(mlir::Operation *op, std::optional<double> probability);

/// How probable it is that the blocks of a loop's body, from the first one,
/// come to the last one with a 1 for `again`, which is an argument of that.
/// Nothing where a branch decides it of which nothing is said.
std::optional<double> computeIterationProbability(mlir::Block *first,
                                                  mlir::BlockArgument again);

/// Keeps what is known of a branch or a loop that a pattern writes anew. It has
/// no state: all rewriters may share it.
mlir::RewriterBase::Listener *getProbabilityKeeper();

} // namespace piko

#endif // PIKO_ANALYSIS_BRANCHPROBABILITY_H
