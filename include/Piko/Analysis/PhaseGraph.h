// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The graph of a pipeline at the authored level, asked from a stage, and what
// passes that move phases along its edges share.

#ifndef PIKO_ANALYSIS_PHASEGRAPH_H
#define PIKO_ANALYSIS_PHASEGRAPH_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

llvm::SmallVector<EdgeOp> getEdgesInto(StageOp stage);
llvm::SmallVector<EdgeOp> getEdgesFrom(StageOp stage);
bool hasSource(StageOp stage);

/// What a stage emits to a port.
llvm::SmallVector<EmissionOpInterface> getEmits(StageOp stage, int64_t port);

/// An emission as one that can be given another port and other numbers: itself,
/// or a piko.emit that takes its place.
EmitOp asEmit(EmissionOpInterface emission);

/// The place of a field's first number among those of its record.
int64_t getElementIndex(RecordOp record, llvm::StringRef field);

/// Notes at an access to state whose phase it is from, before the phase becomes
/// a part of another stage's: an error names its stage.
void noteOrigin(mlir::Operation *op, StageOp stage, bool inAssign);

} // namespace piko

#endif // PIKO_ANALYSIS_PHASEGRAPH_H
