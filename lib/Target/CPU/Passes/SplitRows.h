// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Masked loads and stores of rows for which the processor has no instruction,
// as of bytes with AVX2: LLVM tests each lane and accesses it by itself. Most
// masks are full.

#ifndef PIKO_TARGET_CPU_SPLITROWS_H
#define PIKO_TARGET_CPU_SPLITROWS_H

#include "Passes/ProcessorPass.h"

namespace piko {

/// Gives such an access a branch, to a plain one where all lanes take part. To
/// run behind the optimizer, before what hands masks from block to block.
struct SplitRowsPass : ProcessorPass<SplitRowsPass> {
  using ProcessorPass::ProcessorPass;
  static constexpr char features[] = "+sse2";
  static constexpr bool keepsBlocks = false;
  bool change(llvm::Function &function,
              llvm::FunctionAnalysisManager &analyses);
};

} // namespace piko

#endif // PIKO_TARGET_CPU_SPLITROWS_H
