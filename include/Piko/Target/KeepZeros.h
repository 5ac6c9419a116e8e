// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Code generators take `x < 0 ? x : 0` for a minimum: LLVM's test for zeros
// leaves out strict comparisons. On x86 that is right, for its instruction
// makes the same choice. The minimum of 0 and -0 of other machines is -0. So
// for them, what may choose between zeros chooses between integers.

#ifndef PIKO_TARGET_KEEPZEROS_H
#define PIKO_TARGET_KEEPZEROS_H

#include "llvm/IR/PassManager.h"

namespace piko {

/// Runs last, for a machine whose minimum orders zeros.
struct KeepZerosPass : llvm::PassInfoMixin<KeepZerosPass> {
  llvm::PreservedAnalyses run(llvm::Function &function,
                              llvm::FunctionAnalysisManager &);
};

} // namespace piko

#endif // PIKO_TARGET_KEEPZEROS_H
