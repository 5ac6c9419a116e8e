// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Support/BinOwner.h"

using namespace mlir;
using namespace piko;

std::optional<Reason> piko::whyNotOneThread(StageOp stage) {
  const char *why = nullptr;
  if (llvm::is_contained(stage.getBins(), 0))
    why = "a bin is the whole domain; give the stage bins of a size";
  else if (stage.getTile())
    why = "threads share a bin by the pixels that primitives update; give the "
          "stage smaller bins";
  else if (stage.getSplit())
    why = "threads share the primitives of a bin; let the stage change pixels "
          "by update";
  if (!why)
    return std::nullopt;
  return Reason{stage.getLoc(), why};
}
