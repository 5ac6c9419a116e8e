// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The approximations of Piko/Conversion/Approximations.h by instructions of the
// CPU, which give the same for a number as for one of a vector; and llvm.fma of
// floats where the CPU has no instruction for it, exactly, without a call.

#ifndef PIKO_TARGET_CPU_LOWERARITHMETIC_H
#define PIKO_TARGET_CPU_LOWERARITHMETIC_H

#include "llvm/IR/PassManager.h"
#include "llvm/Target/TargetMachine.h"

namespace piko {

/// To run before the optimizer, which may then vectorize loops: says that
/// approximations of a number have vector forms, and writes out what llvm.fma
/// of floats computes where there is no instruction for it.
void prepareArithmetic(llvm::Module &module,
                       const llvm::TargetMachine &machine);

/// Makes approximations instructions. To run last, behind the optimizer, which
/// knows them as functions without effect.
struct LowerArithmeticPass : llvm::PassInfoMixin<LowerArithmeticPass> {
  explicit LowerArithmeticPass(const llvm::TargetMachine &machine)
      : machine(&machine) {}
  llvm::PreservedAnalyses run(llvm::Module &module,
                              llvm::ModuleAnalysisManager &);
  static bool isRequired() { return true; }

private:
  const llvm::TargetMachine *machine;
};

} // namespace piko

#endif // PIKO_TARGET_CPU_LOWERARITHMETIC_H
