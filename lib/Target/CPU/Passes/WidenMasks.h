// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Masks of eight lanes of AVX2, which has none: comparisons give 32 bits for
// each lane, but what leaves a block has as few as LLVM can hold, 16, and is
// packed there and unpacked in each block that takes it.

#ifndef PIKO_TARGET_CPU_WIDENMASKS_H
#define PIKO_TARGET_CPU_WIDENMASKS_H

#include "Passes/ProcessorPass.h"

namespace piko {

/// Gives masks that go from block to block 32 bits for each lane, where the
/// function's processor has AVX2 alone. To run behind the optimizer, which
/// would undo it.
struct WidenMasksPass : ProcessorPass<WidenMasksPass> {
  using ProcessorPass::ProcessorPass;
  static constexpr char features[] = "+avx2,-avx512vl";
  bool change(llvm::Function &function,
              llvm::FunctionAnalysisManager &analyses);
};

} // namespace piko

#endif // PIKO_TARGET_CPU_WIDENMASKS_H
