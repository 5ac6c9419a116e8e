// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What pikoc does: read a pipeline, and take it down the levels.

#ifndef PIKO_DRIVER_COMPILER_H
#define PIKO_DRIVER_COMPILER_H

#include "Piko/Driver/Options.h"
#include "Piko/Driver/Registration.h"
#include "Piko/Frontend/Frontend.h"

#include "mlir/IR/BuiltinOps.h"
#include "mlir/IR/OwningOpRef.h"
#include "llvm/Support/VirtualFileSystem.h"

#include <string>
#include <vector>

namespace llvm {
class LLVMContext;
class Module;
} // namespace llvm

namespace mlir {
class OpPassManager;
} // namespace mlir

namespace piko {

/// The levels that the compiler moves a module down, in order.
enum class Level { Authored, Kernels, Machine, Target, LLVM };

/// The level that a module is at, as its operations show. Passes in between
/// make modules of the level above: taking those down does again what is done,
/// which changes nothing.
Level getLevel(mlir::ModuleOp module);

/// What `--emit` calls it.
llvm::StringRef getName(Level level);

/// Where piko.h is: beside the tool that is running, or the library that this
/// is in, as it is installed, or in the source tree.
std::string getRuntimeIncludeDir();

/// Precompiled headers in the cache.
std::shared_ptr<HeaderStore> makeHeaderStore(const CacheOptions &options);

/// The options as the C++ front end takes them.
FrontendOptions getFrontendOptions(const CompileOptions &options);

/// Reads the file from among `files`: a module that holds one pipeline, at the
/// authored level or, from `.mlir`, at any; or null after diagnostics in the
/// context's engine.
mlir::OwningOpRef<mlir::ModuleOp>
readPipeline(const CompileOptions &options, mlir::MLIRContext &context,
             llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files =
                 llvm::vfs::getRealFileSystem());

/// The name of a pipeline that readPipeline() read. At the target level and
/// below, a module may still hold others; then it must be given.
std::string getPipelineName(mlir::ModuleOp module,
                            const CompileOptions &options);

/// The names of the pipelines in a file, in the order in which they stand
/// there.
llvm::FailureOr<std::vector<std::string>>
readPipelineNames(const CompileOptions &options, mlir::MLIRContext &context,
                  llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files =
                      llvm::vfs::getRealFileSystem());

/// The tunables of a file; `.mlir` has none.
llvm::FailureOr<std::vector<TunableDescription>>
readTunables(const CompileOptions &options, mlir::MLIRContext &context,
             llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files =
                 llvm::vfs::getRealFileSystem());

/// Adds the passes that take a module from one level to another one.
void addPasses(mlir::OpPassManager &passes, Level from, Level to,
               const CheckOptions &check, const SynthesisOptions &synthesis,
               const GPUOptions &gpu = {}, const CPUOptions &cpu = {});

/// Takes a module from its level to another one; an error if it is below that.
llvm::LogicalResult lowerPipeline(mlir::ModuleOp module, Level level,
                                  const CheckOptions &check = {},
                                  const SynthesisOptions &synthesis = {},
                                  const GPUOptions &gpu = {},
                                  const CPUOptions &cpu = {});

/// Takes a module to Level::LLVM for each of several processors. What is the
/// same for all of them is done once, in `module` itself. None after
/// diagnostics.
llvm::SmallVector<mlir::OwningOpRef<mlir::ModuleOp>>
lowerForEach(llvm::ArrayRef<CPUOptions> cpus, mlir::ModuleOp module,
             const CheckOptions &check, const SynthesisOptions &synthesis,
             const GPUOptions &gpu);

/// LLVM IR, not optimised, of what the llvm dialect has, a module or a
/// `gpu.module`, with what it has inline of the runtime. Null after
/// diagnostics.
std::unique_ptr<llvm::Module> translate(mlir::Operation *op,
                                        llvm::LLVMContext &context,
                                        llvm::StringRef name);

/// LLVM IR, not optimised, of a module at Level::LLVM, with its kernels for a
/// GPU as `gpu` says: PTX made with `optLevel`, and cubins, or functions for
/// the emulator. Null after diagnostics.
std::unique_ptr<llvm::Module> translateToLLVMIR(mlir::ModuleOp module,
                                                llvm::LLVMContext &context,
                                                const GPUOptions &gpu = {},
                                                int optLevel = 3);

/// Takes a module from the machine level or above to one with a `gpu.module`,
/// unless it has one; an error if the pipeline has no kernel for a GPU.
llvm::LogicalResult lowerToGPU(mlir::ModuleOp module, const CheckOptions &check,
                               const SynthesisOptions &synthesis,
                               const GPUOptions &gpu);

/// LLVM IR, not optimised, of the kernels for a GPU that lowerToGPU() made;
/// null after diagnostics.
std::unique_ptr<llvm::Module> translateKernels(mlir::ModuleOp module,
                                               llvm::LLVMContext &context);

} // namespace piko

#endif // PIKO_DRIVER_COMPILER_H
