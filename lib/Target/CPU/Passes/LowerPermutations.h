// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The permutations of Piko/Conversion/Permutations.h by instructions of the
// CPU, or through memory where it has none.

#ifndef PIKO_TARGET_CPU_LOWERPERMUTATIONS_H
#define PIKO_TARGET_CPU_LOWERPERMUTATIONS_H

#include "llvm/IR/Module.h"
#include "llvm/Target/TargetMachine.h"

namespace piko {

/// Replaces all calls, in functions that may be for different processors. To
/// run before the optimizer, which knows what the instructions do.
void lowerPermutations(llvm::Module &module,
                       const llvm::TargetMachine &machine);

} // namespace piko

#endif // PIKO_TARGET_CPU_LOWERPERMUTATIONS_H
