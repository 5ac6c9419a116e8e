// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What pikoc does: read a pipeline, and take it down the levels.

#ifndef PIKO_DRIVER_COMPILER_H
#define PIKO_DRIVER_COMPILER_H

#include "Piko/Driver/Registration.h"
#include "Piko/Frontend/Frontend.h"

#include "mlir/IR/BuiltinOps.h"
#include "mlir/IR/OwningOpRef.h"

#include <string>
#include <vector>

namespace llvm {
class LLVMContext;
class Module;
} // namespace llvm

namespace piko {

/// The levels that the compiler moves a module down, in order.
enum class Level { Authored, Kernels, Resolved, Target, LLVM };

struct CompileOptions {
  /// A pipeline's C++, or `.mlir` at the authored level.
  std::string file;
  /// The pipeline to compile; empty = the only one in the file.
  std::string pipeName;
  /// `-I` and `-D`, without the letter.
  std::vector<std::string> includeDirs, defines;
};

/// The same, for the C++ front end.
FrontendOptions getFrontendOptions(const CompileOptions &options);

/// Reads the file: a module at the authored level that holds one pipeline, or
/// null after diagnostics in the context's engine.
mlir::OwningOpRef<mlir::ModuleOp> readPipeline(const CompileOptions &options,
                                               mlir::MLIRContext &context);

/// The names of the pipelines in a file, in the order in which they stand
/// there.
llvm::FailureOr<std::vector<std::string>>
readPipelineNames(const CompileOptions &options, mlir::MLIRContext &context);

/// Takes a module from the authored level to another one.
llvm::LogicalResult lowerPipeline(mlir::ModuleOp module, Level level);

/// LLVM IR, not optimised, of a module at Level::LLVM; null after diagnostics.
std::unique_ptr<llvm::Module> translateToLLVMIR(mlir::ModuleOp module,
                                                llvm::LLVMContext &context);

} // namespace piko

#endif // PIKO_DRIVER_COMPILER_H
