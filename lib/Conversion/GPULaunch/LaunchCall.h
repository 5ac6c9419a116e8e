// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the conversions of launches share: a call of the runtime takes the place
// of a gpu.launch_func, and finds the arguments in memory, eight bytes each.

#ifndef PIKO_LIB_CONVERSION_GPULAUNCH_LAUNCHCALL_H
#define PIKO_LIB_CONVERSION_GPULAUNCH_LAUNCHCALL_H

#include "mlir/Dialect/Func/IR/FuncOps.h"
#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/LLVMIR/LLVMDialect.h"

namespace piko {

/// The operands of a call: values of the LLVM dialect.
struct LaunchCall {
  mlir::Value pipeline;        ///< Of the runtime.
  mlir::Value blocks, threads; ///< i64
  mlir::Value arguments;       ///< Their address.
  int64_t count;               ///< Of arguments.
};

/// Stores arguments of a launch where `builder` is, as words of eight bytes;
/// fails with an error for one that is not a number.
llvm::LogicalResult storeArguments(mlir::OpBuilder &builder,
                                   mlir::gpu::LaunchFuncOp launch,
                                   mlir::ValueRange arguments,
                                   mlir::Value words);

/// Writes the arguments to memory before the launch; fails with an error
/// for a grid of several dimensions or an argument that is not a number.
llvm::FailureOr<LaunchCall> createLaunchCall(mlir::gpu::LaunchFuncOp launch);

/// Converts all launches of a module, which is for a CPU alone then. Fails
/// where `convert` does, which leaves the launch to be erased.
llvm::LogicalResult convertLaunches(
    mlir::ModuleOp module,
    llvm::function_ref<llvm::LogicalResult(mlir::gpu::LaunchFuncOp)> convert);

/// A function without result, declared on first use.
mlir::LLVM::LLVMFuncOp declareFunction(mlir::ModuleOp module,
                                       llvm::StringRef name,
                                       llvm::ArrayRef<mlir::Type> arguments);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_GPULAUNCH_LAUNCHCALL_H
