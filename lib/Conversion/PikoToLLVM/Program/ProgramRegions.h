// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the writers of NAME.setup, NAME.run and a program's steps share: how
// they call its regions.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_PROGRAMREGIONS_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_PROGRAMREGIONS_H

#include "PikoToLLVM/LoweringContext.h"

#include "Piko/Dialect/Piko/IR/PikoProgram.h"

#include "llvm/ADT/SetVector.h"

namespace piko {

/// The stages whose kernels are launched in a region, in order.
llvm::SmallSetVector<int32_t, 8> findStages(mlir::Operation *region,
                                            const PipelineNumbers &numbers);

/// The number of a region among those that the runtime counts with it: strips,
/// waves, or cycles. Cycles are waves and rounds that are not part of others.
int32_t getNumber(mlir::Operation *region, bool asCycle = false);
/// The number of a source among those of its pipeline.
int32_t getSourceNumber(SourceOp source);

/// NAME.setup, which declares the pipeline to the runtime.
mlir::func::FuncOp createSetup(ProgramOp program,
                               const PipelineNumbers &numbers,
                               LoweringContext &context,
                               mlir::OpBuilder &builder);

/// The steps of a program, an array of StepAttr (ProgramSteps.cpp).
mlir::ArrayAttr describeSteps(ProgramOp program,
                              const PipelineNumbers &numbers);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_PROGRAMREGIONS_H
