// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Lanes that store numbers of 8 or 16 bits one after the other: to take such a
// number out of a vector occupies the unit for shuffles, which is what such
// code waits for, once for each lane. Here 64 bits are taken out at once, and
// units for integers shift them.

#ifndef PIKO_TARGET_CPU_STORELANES_H
#define PIKO_TARGET_CPU_STORELANES_H

#include "Passes/ProcessorPass.h"

namespace piko {

/// To run behind the optimizer, which would join what is shifted again.
struct StoreLanesPass : ProcessorPass<StoreLanesPass> {
  using ProcessorPass::ProcessorPass;
  static constexpr char features[] = "";
  bool change(llvm::Function &function,
              llvm::FunctionAnalysisManager &analyses);
};

} // namespace piko

#endif // PIKO_TARGET_CPU_STORELANES_H
