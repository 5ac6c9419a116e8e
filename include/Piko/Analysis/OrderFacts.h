// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which stages give the same results in whatever order their primitives come.

#ifndef PIKO_ANALYSIS_ORDERFACTS_H
#define PIKO_ANALYSIS_ORDERFACTS_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Whether nothing tells in which order a stage, with all that was fused into
/// it, has processed its primitives: it is unordered by its schedule, or it
/// emits nothing, and changes each piece of state by stores, or in one way that
/// commutes: by one kind of atomic operation, or by updates that make a pixel's
/// numbers the sums, the maxima or such of themselves and of others, in
/// integers.
bool isOrderIrrelevant(PipelineOp pipeline, StageOp stage);

} // namespace piko

#endif // PIKO_ANALYSIS_ORDERFACTS_H
