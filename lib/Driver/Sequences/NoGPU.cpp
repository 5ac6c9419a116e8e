// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What stands for code generation for GPUs in a build without it: errors.

#include "Piko/Driver/Sequences.h"
#include "Piko/Target/Assembler.h"
#include "Piko/Target/KernelImages.h"
#include "Piko/Target/KernelResources.h"
#include "Piko/Target/PTX.h"
#include "Sequences/SequenceParts.h"

#include "mlir/IR/BuiltinOps.h"
#include "mlir/Pass/Pass.h"

using namespace mlir;
using namespace piko;

static constexpr StringLiteral
    lack("expected a build with code generation for GPUs, which "
         "`make build` makes");

static llvm::Error createError() {
  return llvm::createStringError(lack.data());
}

//===----------------------------------------------------------------------===//
// Sequences
//===----------------------------------------------------------------------===//

namespace {
/// Fails at what was to have kernels for a GPU.
struct RefusePass : PassWrapper<RefusePass, OperationPass<ModuleOp>> {
  MLIR_DEFINE_EXPLICIT_INTERNAL_INLINE_TYPE_ID(RefusePass)
  void runOnOperation() override {
    getOperation().emitError(lack);
    signalPassFailure();
  }
};
} // namespace

void piko::registerGPUDialects(DialectRegistry &) {}

void piko::addGridSequence(OpPassManager &passes, const SynthesisOptions &) {
  passes.nest<ModuleOp>().addPass(std::make_unique<RefusePass>());
}

void piko::addGPUSequence(OpPassManager &passes, const GPUOptions &,
                          const SynthesisOptions &) {
  passes.addPass(std::make_unique<RefusePass>());
}

void piko::addLaunchSequence(OpPassManager &passes, const GPUOptions &) {
  passes.addPass(std::make_unique<RefusePass>());
}

void piko::addNVVMSequence(OpPassManager &passes) {
  passes.addPass(std::make_unique<RefusePass>());
}

//===----------------------------------------------------------------------===//
// PTX
//===----------------------------------------------------------------------===//

llvm::Expected<std::string> piko::generatePTX(llvm::Module &, StringRef, int) {
  return createError();
}

std::string piko::getPTXLayout() { return ""; }

llvm::Error piko::checkChip(StringRef) { return createError(); }

llvm::Error piko::embedKernels(llvm::Module &, llvm::Module &, StringRef,
                               const GPUOptions &, int,
                               llvm::function_ref<void(const MissingCubin &)>) {
  return createError();
}

llvm::Expected<KernelReport> piko::measureKernels(const llvm::Module &,
                                                  StringRef, StringRef) {
  return createError();
}

std::optional<int64_t> piko::getResidentThreads(llvm::StringRef) {
  return std::nullopt;
}

std::optional<double> KernelResources::getOccupancy(StringRef) const {
  return std::nullopt;
}

std::string piko::findAssembler() { return ""; }

std::string piko::getAssemblerIdentity(StringRef) { return ""; }
