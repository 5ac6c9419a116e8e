// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The table of steps by which a CUDA device runs a program by itself.

#ifndef PIKO_LIB_CONVERSION_GPULAUNCH_STEPTABLE_H
#define PIKO_LIB_CONVERSION_GPULAUNCH_STEPTABLE_H

#include "GPULaunch/LaunchCall.h"

#include "mlir/Interfaces/FunctionInterfaces.h"

namespace piko {

/// Where a module has the name of a kernel, as a text that ends with a zero
/// byte; the address of that.
using KernelNamer =
    llvm::function_ref<mlir::Value(mlir::OpBuilder &, mlir::gpu::LaunchFuncOp)>;

/// Makes of the `piko.steps` of a setup a constant table, which the setup gives
/// to the runtime where `builder` is: with the launches of each kernel, which
/// are not yet converted. Fails with an error where the arguments of one depend
/// on what only the kernel's own function knows.
llvm::LogicalResult createStepTable(mlir::FunctionOpInterface setup,
                                    mlir::OpBuilder &builder,
                                    KernelNamer nameKernel);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_GPULAUNCH_STEPTABLE_H
