// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What synthesis makes of a pipeline, as text for its author: the stages in
// order, the kernels with their phases, what each pass did or refused, and what
// it changed.

#ifndef PIKO_DRIVER_EXPLAIN_H
#define PIKO_DRIVER_EXPLAIN_H

#include "Piko/Driver/Options.h"

#include "mlir/IR/BuiltinOps.h"

#include <string>

namespace piko {

/// Takes a module that holds one pipeline from the authored to the target
/// level, and reports on it; fails after diagnostics in the context's engine.
/// For CUDA, with what the kernels take of the chip.
llvm::FailureOr<std::string>
explainPipeline(mlir::ModuleOp module, const CheckOptions &check = {},
                const SynthesisOptions &synthesis = {},
                const CPUOptions &cpu = {}, const GPUOptions &gpu = {},
                int optLevel = 3);

} // namespace piko

#endif // PIKO_DRIVER_EXPLAIN_H
