// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Runs what is done behind the optimizer on small functions in LLVM IR.

#ifndef PIKO_UNITTESTS_TARGET_PASSTEST_H
#define PIKO_UNITTESTS_TARGET_PASSTEST_H

#include "llvm/AsmParser/Parser.h"
#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"
#include "llvm/IR/Verifier.h"
#include "llvm/MC/TargetRegistry.h"
#include "llvm/Passes/PassBuilder.h"
#include "llvm/Support/SourceMgr.h"
#include "llvm/Support/TargetSelect.h"
#include "llvm/Support/raw_ostream.h"
#include "llvm/Target/TargetMachine.h"
#include "llvm/TargetParser/Host.h"
#include "llvm/TargetParser/Triple.h"

#include <gtest/gtest.h>

/// With a machine that has AVX-512. Skips on other processors than x86.
class PassTest : public testing::Test {
protected:
  void SetUp() override {
    llvm::InitializeNativeTarget();
    llvm::Triple triple(llvm::sys::getProcessTriple());
    if (!triple.isX86())
      GTEST_SKIP() << "for x86 alone";
    std::string error;
    const llvm::Target *target =
        llvm::TargetRegistry::lookupTarget(triple, error);
    ASSERT_TRUE(target) << error;
    machine.reset(target->createTargetMachine(triple, "x86-64-v4", "", {}, {}));
  }

  /// The first function of a text, after the pass; null where the text is
  /// wrong.
  template <class Pass> llvm::Function *run(llvm::StringRef text) {
    llvm::SMDiagnostic error;
    module = llvm::parseAssemblyString(text, error, context);
    if (!module) {
      ADD_FAILURE() << error.getMessage().str();
      return nullptr;
    }
    module->setDataLayout(machine->createDataLayout());
    llvm::Function &function = module->getFunctionList().front();
    llvm::LoopAnalysisManager loops;
    llvm::FunctionAnalysisManager functions;
    llvm::CGSCCAnalysisManager components;
    llvm::ModuleAnalysisManager modules;
    llvm::PassBuilder builder(machine.get());
    builder.registerModuleAnalyses(modules);
    builder.registerCGSCCAnalyses(components);
    builder.registerFunctionAnalyses(functions);
    builder.registerLoopAnalyses(loops);
    builder.crossRegisterProxies(loops, functions, components, modules);
    Pass(*machine).run(function, functions);
    EXPECT_FALSE(llvm::verifyModule(*module, &llvm::errs()));
    return &function;
  }

private:
  llvm::LLVMContext context;
  std::unique_ptr<llvm::Module> module;
  std::unique_ptr<llvm::TargetMachine> machine;
};

#endif // PIKO_UNITTESTS_TARGET_PASSTEST_H
