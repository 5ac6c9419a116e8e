// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM makes a branch of a scalar select between floats on x86, as no
// instruction moves a vector register by the flags; only where a comparison of
// floats gives a mask is it a blend. Here such a select is one between their
// bits, which cmov does, or, between a number and its negation, a sign that is
// flipped or not.

#ifndef PIKO_TARGET_CPU_SELECTBITS_H
#define PIKO_TARGET_CPU_SELECTBITS_H

#include "llvm/IR/PassManager.h"

namespace piko {

/// To run last, as the optimizer prefers selects between floats. Those stay
/// whose condition is a comparison of floats, does not change in the loop, or
/// has branch weights.
struct SelectBitsPass : llvm::PassInfoMixin<SelectBitsPass> {
  llvm::PreservedAnalyses run(llvm::Function &function,
                              llvm::FunctionAnalysisManager &analyses);
};

} // namespace piko

#endif // PIKO_TARGET_CPU_SELECTBITS_H
