// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What stands for code generation for GPUs in the build of `make demo`, linked
// here in place of it.

#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/Registration.h"
#include "Piko/Driver/Sequences.h"
#include "Piko/Target/KernelImages.h"
#include "Piko/Target/KernelResources.h"
#include "Piko/Target/PTX.h"

#include "mlir/IR/BuiltinOps.h"
#include "mlir/IR/Diagnostics.h"
#include "mlir/IR/MLIRContext.h"

#include <gtest/gtest.h>

using namespace mlir;
using namespace piko;

namespace {

constexpr char lack[] = "expected a build with code generation for GPUs, which "
                        "`make build` makes";

class NoGPUTest : public testing::Test {
protected:
  NoGPUTest() {
    DialectRegistry registry;
    registerPikoDialects(registry);
    context.appendDialectRegistry(registry);
  }

  /// What lowering an empty module to a level says.
  std::string lower(Level level, GPUTarget target) {
    GPUOptions gpu;
    gpu.target = target;
    std::string said;
    ScopedDiagnosticHandler handler(&context, [&](Diagnostic &diagnostic) {
      said += diagnostic.str();
      return success();
    });
    OwningOpRef<ModuleOp> module = ModuleOp::create(UnknownLoc::get(&context));
    PassManager passes(&context);
    addPasses(passes, Level::Authored, level, {}, {}, gpu);
    bool hasFailed = failed(passes.run(*module));
    EXPECT_EQ(hasFailed, !said.empty());
    return said;
  }

  MLIRContext context;
};

TEST_F(NoGPUTest, RefusesKernels) {
  EXPECT_EQ(lower(Level::LLVM, GPUTarget::CUDA), lack);
  EXPECT_EQ(lower(Level::LLVM, GPUTarget::Emulator), lack);
}

TEST_F(NoGPUTest, HasTheRest) {
  EXPECT_EQ(lower(Level::LLVM, GPUTarget::None), "");
  EXPECT_EQ(lower(Level::Machine, GPUTarget::CUDA), "");
}

TEST_F(NoGPUTest, RefusesPTX) {
  llvm::LLVMContext llvm;
  llvm::Module host("host", llvm), kernels("kernels", llvm);
  EXPECT_EQ(toString(generatePTX(kernels, "sm_70", 3).takeError()), lack);
  EXPECT_EQ(toString(embedKernels(host, kernels, "images", {}, 3, nullptr)),
            lack);
  EXPECT_EQ(toString(measureKernels(kernels, "", "sm_70").takeError()), lack);
}

} // namespace
