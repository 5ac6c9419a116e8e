// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Calls that report an error clobber no register. A call clobbers each vector
// and mask register, so whatever lives across it is spilled, in the hot code
// around it, too, however seldom the call is reached: each access to a buffer
// has such a call, which reports an index outside it.
//
//   call @pikoir_fail_index(..)
//
// becomes
//
//   call @pikoir_fail_index.preserving(..)   ; saves and restores all registers

#ifndef PIKO_TARGET_CPU_PRESERVEREGISTERS_H
#define PIKO_TARGET_CPU_PRESERVEREGISTERS_H

#include "llvm/IR/Module.h"
#include "llvm/IR/PassManager.h"
#include "llvm/Target/TargetMachine.h"

namespace piko {

/// For x86, behind the optimizer, which would inline what is made here.
class PreserveRegistersPass
    : public llvm::PassInfoMixin<PreserveRegistersPass> {
public:
  explicit PreserveRegistersPass(const llvm::TargetMachine &machine)
      : machine(&machine) {}

  llvm::PreservedAnalyses run(llvm::Module &module,
                              llvm::ModuleAnalysisManager &analyses);

private:
  const llvm::TargetMachine *machine;
};

} // namespace piko

#endif // PIKO_TARGET_CPU_PRESERVEREGISTERS_H
