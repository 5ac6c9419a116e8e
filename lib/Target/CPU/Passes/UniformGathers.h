// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM's loop vectorizer makes a gather of what an iteration of a loop loads
// under a condition, also where all iterations load from one place: nothing
// says that memory is there if no iteration's condition holds. A gather takes
// an access for each lane, though all are the same. Here one masked load does
// it, for all lanes.

#ifndef PIKO_TARGET_CPU_UNIFORMGATHERS_H
#define PIKO_TARGET_CPU_UNIFORMGATHERS_H

#include "Passes/ProcessorPass.h"

namespace piko {

/// For processors with AVX. To run behind the optimizer.
struct UniformGathersPass : ProcessorPass<UniformGathersPass> {
  using ProcessorPass::ProcessorPass;
  static constexpr char features[] = "+avx";
  bool change(llvm::Function &function,
              llvm::FunctionAnalysisManager &analyses);
};

} // namespace piko

#endif // PIKO_TARGET_CPU_UNIFORMGATHERS_H
