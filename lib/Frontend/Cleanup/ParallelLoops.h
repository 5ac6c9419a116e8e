//===- ParallelLoops.h - parallelFor in LLVM IR -----------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A parallelFor is a loop whose header asks the marker loopMore. To LLVM its
// iterations run one after the other, which is right until they meet: what is
// theirs and what they share is told apart here.
//
// A variable is an iteration's own where its life begins inside the loop, which
// inlining says. To be set to poison there keeps it from being carried from one
// iteration to the next.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_LIB_FRONTEND_CLEANUP_PARALLELLOOPS_H
#define PIKO_LIB_FRONTEND_CLEANUP_PARALLELLOOPS_H

#include "Parse/Parse.h"
#include "Support/Memory.h"
#include "llvm/Analysis/LoopInfo.h"
#include "llvm/IR/Dominators.h"

namespace piko {

struct ParallelLoop {
  llvm::Loop *blocks;
  /// The call of loopMore, in the header.
  llvm::CallInst *more;
  const ParallelLoop *outer;

  /// The same from one step of the clean-up to the next.
  int64_t getNumber() const;
};

/// The loops of a function, as it is now.
class ParallelLoops {
public:
  ParallelLoops(llvm::Function &function, const MarkerTable &markers);

  /// The innermost loop around a block, or null.
  const ParallelLoop *get(const llvm::BasicBlock *block) const;
  /// The loop that a block is the header of, or null.
  const ParallelLoop *getByHeader(const llvm::BasicBlock *block) const;

private:
  llvm::DominatorTree dominance;
  llvm::LoopInfo loops;
  std::vector<std::unique_ptr<ParallelLoop>> parallel;
  llvm::DenseMap<const llvm::Loop *, const ParallelLoop *> byLoop;
};

/// Numbers new loops, and notes what belongs to their iterations.
void labelLoops(llvm::Function &function, MemoryMap &memory);

/// The number of the loop to whose iterations a variable belongs; 0 = none.
int64_t getOwner(const llvm::AllocaInst *variable);

/// What the user calls a variable, in quotes, or nothing.
std::string getVariableName(const llvm::AllocaInst *variable);

/// mem2reg. A variable that iterations share and assign is an error; false
/// then.
bool promoteVariables(llvm::Function &function, const ParsedUnit &unit,
                      mlir::MLIRContext &context);

/// Keeps arrays that iterations share and write in memory, where a barrier
/// shows what the others wrote.
void shareArrays(llvm::Function &function, MemoryMap &memory);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_CLEANUP_PARALLELLOOPS_H
