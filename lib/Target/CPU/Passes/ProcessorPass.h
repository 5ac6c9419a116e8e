// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What passes on LLVM IR have in common that do something for some x86
// processors alone.

#ifndef PIKO_TARGET_CPU_PROCESSORPASS_H
#define PIKO_TARGET_CPU_PROCESSORPASS_H

#include "llvm/CodeGen/TargetSubtargetInfo.h"
#include "llvm/IR/Function.h"
#include "llvm/IR/PassManager.h"
#include "llvm/Target/TargetMachine.h"

namespace piko {

/// A pass `Pass` on functions, to run behind the optimizer. Its `change` says
/// whether it has changed a function, of which it keeps the blocks unless
/// `Pass::keepsBlocks` is false; it gets those whose processor has
/// `Pass::features`. Where `Pass::readsBeyond` is
/// true, it may load what lies beside an object, of which AddressSanitizer
/// would tell: functions for it stay as they are.
template <class Pass> class ProcessorPass : public llvm::PassInfoMixin<Pass> {
public:
  explicit ProcessorPass(const llvm::TargetMachine &machine)
      : machine(&machine) {}

  llvm::PreservedAnalyses run(llvm::Function &function,
                              llvm::FunctionAnalysisManager &analyses) {
    bool applies =
        machine->getSubtargetImpl(function)->checkFeatures(Pass::features) &&
        !(Pass::readsBeyond &&
          function.hasFnAttribute(llvm::Attribute::SanitizeAddress));
    if (!applies || !static_cast<Pass *>(this)->change(function, analyses))
      return llvm::PreservedAnalyses::all();
    llvm::PreservedAnalyses preserved;
    if (Pass::keepsBlocks)
      preserved.preserveSet<llvm::CFGAnalyses>();
    return preserved;
  }

  static constexpr bool readsBeyond = false, keepsBlocks = true;

private:
  const llvm::TargetMachine *machine;
};

} // namespace piko

#endif // PIKO_TARGET_CPU_PROCESSORPASS_H
