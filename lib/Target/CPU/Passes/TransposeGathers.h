// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM's loop vectorizer makes a gather of each word that an iteration of a
// loop loads from a record, or from a short array in it. Here each lane loads
// words side by side at once, four of them, and blocks of 4 x 4 words are
// transposed: a gather takes an access for each lane and word.

#ifndef PIKO_TARGET_CPU_TRANSPOSEGATHERS_H
#define PIKO_TARGET_CPU_TRANSPOSEGATHERS_H

#include "Passes/ProcessorPass.h"

namespace piko {

/// Of gathers in a block by all lanes, for processors with AVX2. To run after
/// the optimizer.
struct TransposeGathersPass : ProcessorPass<TransposeGathersPass> {
  using ProcessorPass::ProcessorPass;
  static constexpr char features[] = "+avx2";
  static constexpr bool readsBeyond = true;
  bool change(llvm::Function &function,
              llvm::FunctionAnalysisManager &analyses);
};

} // namespace piko

#endif // PIKO_TARGET_CPU_TRANSPOSEGATHERS_H
