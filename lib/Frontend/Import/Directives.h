//===- Directives.h - What a schedule phase says ----------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_IMPORT_DIRECTIVES_H
#define PIKO_LIB_FRONTEND_IMPORT_DIRECTIVES_H

#include "Parse/Parse.h"
#include "llvm/Analysis/LoopInfo.h"
#include "llvm/Analysis/PostDominators.h"
#include "llvm/IR/Dominators.h"

namespace piko {

/// Tells which blocks run once, after and beside loops that fill members.
class Once {
public:
  explicit Once(llvm::Function &function)
      : entry(function.getEntryBlock()), begins(function), ends(function),
        loops(begins) {}

  bool contains(const llvm::BasicBlock *block) const {
    return ends.dominates(block, &entry) && !loops.getLoopFor(block);
  }

private:
  llvm::BasicBlock &entry;
  llvm::DominatorTree begins;
  llvm::PostDominatorTree ends;
  llvm::LoopInfo loops;
};

/// Reads what a stage's cleaned schedule phase says into its description; see
/// piko/markers.def. False after an error.
bool readDirectives(llvm::Function &phase, StageDescription &stage,
                    const ParsedUnit &unit, mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_DIRECTIVES_H
