// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What passes on LLVM IR have in common that do something for some processors
// alone.

#ifndef PIKO_TARGET_CPU_PROCESSORPASS_H
#define PIKO_TARGET_CPU_PROCESSORPASS_H

#include "llvm/IR/PassManager.h"
#include "llvm/Target/TargetMachine.h"

namespace piko {

/// A pass `Pass` on functions, which asks the machine what a function's
/// processor has.
template <class Pass> class ProcessorPass : public llvm::PassInfoMixin<Pass> {
public:
  explicit ProcessorPass(const llvm::TargetMachine &machine)
      : machine(&machine) {}

protected:
  const llvm::TargetMachine *machine;
};

} // namespace piko

#endif // PIKO_TARGET_CPU_PROCESSORPASS_H
