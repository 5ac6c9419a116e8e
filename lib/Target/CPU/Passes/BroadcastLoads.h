// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A broadcast from memory takes a load port; one from a register takes a port
// that vector arithmetic needs, a quarter of all slots in a loop over lights.
// Instructions are selected block by block, and the SLP vectorizer loads
// scalars that stand side by side as one vector. So a number that was loaded in
// another block, or with others, is broadcast from a register. Here it is
// loaded again where it is broadcast.

#ifndef PIKO_TARGET_CPU_BROADCASTLOADS_H
#define PIKO_TARGET_CPU_BROADCASTLOADS_H

#include "Passes/ProcessorPass.h"

namespace piko {

/// For processors with AVX. To run last, as the optimizer would merge the loads
/// again. A load is repeated only in the loop that it stands in, and where
/// MemorySSA knows of nothing in between that may write there.
struct BroadcastLoadsPass : ProcessorPass<BroadcastLoadsPass> {
  using ProcessorPass::ProcessorPass;
  static constexpr char features[] = "+avx";
  bool change(llvm::Function &function,
              llvm::FunctionAnalysisManager &analyses);
};

} // namespace piko

#endif // PIKO_TARGET_CPU_BROADCASTLOADS_H
