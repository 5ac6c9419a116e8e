// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the parts of piko-form-work share.

#ifndef PIKO_LIB_TRANSFORMS_FORMWORK_H
#define PIKO_LIB_TRANSFORMS_FORMWORK_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Replaces queries of bins by arithmetic. `bin` is null where no bin is being
/// processed.
void expandQueries(mlir::Operation *root, StageOp stage, mlir::Value bin);

/// Turns the dynamic body of a schedule into a kernel that stands before all
/// others; the directives stay with the stage.
void formScheduleKernel(ScheduleOp schedule);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_FORMWORK_H
