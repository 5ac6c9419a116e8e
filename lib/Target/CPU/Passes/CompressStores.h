// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Compressing stores of AVX-512. To memory, the instruction takes more than a
// hundred cycles on Zen 4, where in registers it takes two.

#ifndef PIKO_TARGET_CPU_COMPRESSSTORES_H
#define PIKO_TARGET_CPU_COMPRESSSTORES_H

#include "Passes/ProcessorPass.h"

namespace piko {

/// Compresses in registers, a vector of 512 bits at a time, and stores as many
/// lanes as there are, where the function's processor has AVX-512.
struct CompressStoresPass : ProcessorPass<CompressStoresPass> {
  using ProcessorPass::ProcessorPass;
  static constexpr char features[] = "+avx512vl";
  bool change(llvm::Function &function,
              llvm::FunctionAnalysisManager &analyses);
};

} // namespace piko

#endif // PIKO_TARGET_CPU_COMPRESSSTORES_H
