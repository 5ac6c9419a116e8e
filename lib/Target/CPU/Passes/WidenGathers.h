// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Gathers of bytes and of 16 bits, for which there is no instruction: LLVM
// makes a branch and a load of each lane.

#ifndef PIKO_TARGET_CPU_WIDENGATHERS_H
#define PIKO_TARGET_CPU_WIDENGATHERS_H

#include "Passes/ProcessorPass.h"

namespace piko {

/// Gathers the aligned words of 32 bits that narrow numbers lie in, which no
/// page ends within, and shifts those out, where the function's processor has
/// AVX2. To run behind the optimizer, which must not know: a word may go
/// beyond an object. AddressSanitizer would tell of that, so functions for it
/// stay as they are.
struct WidenGathersPass : ProcessorPass<WidenGathersPass> {
  using ProcessorPass::ProcessorPass;
  static constexpr char features[] = "+avx2";
  static constexpr bool readsBeyond = true;
  bool change(llvm::Function &function,
              llvm::FunctionAnalysisManager &analyses);
};

} // namespace piko

#endif // PIKO_TARGET_CPU_WIDENGATHERS_H
