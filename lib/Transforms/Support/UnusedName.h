// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Names for what passes add to a pipeline.

#ifndef PIKO_LIB_TRANSFORMS_UNUSEDNAME_H
#define PIKO_LIB_TRANSFORMS_UNUSEDNAME_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// A name that no symbol of the pipeline has: the stem, or one with a number
/// after it, from 1 on.
std::string getUnusedName(PipelineOp pipeline, const llvm::Twine &stem);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_UNUSEDNAME_H
