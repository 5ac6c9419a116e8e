// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which loads are repeated where they are broadcast, and which may not be.

#include "../../lib/Target/CPU/BroadcastLoads.h"

#include "llvm/AsmParser/Parser.h"
#include "llvm/IR/InstIterator.h"
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

using namespace llvm;

namespace {

class BroadcastLoads : public testing::Test {
protected:
  void SetUp() override {
    InitializeNativeTarget();
    Triple triple(sys::getProcessTriple());
    if (!triple.isX86())
      GTEST_SKIP() << "for x86 alone";
    std::string error;
    const Target *target = TargetRegistry::lookupTarget(triple, error);
    ASSERT_TRUE(target) << error;
    machine.reset(target->createTargetMachine(triple, "x86-64-v4", "", {}, {}));
  }

  /// Runs the pass on the body of a function of a pointer, a flag, a vector and
  /// another pointer, and says whether a load is right in front of the splat's
  /// insertion, as selection needs it.
  bool isRepeated(StringRef body) {
    std::string text =
        "declare <4 x float> @llvm.fma.v4f32(<4 x float>, <4 x float>, "
        "<4 x float>)\n"
        "define <4 x float> @f(ptr %p, i1 %c, <4 x float> %v, ptr %q) {\n";
    text += body;
    text += "}\n";
    SMDiagnostic error;
    module = parseAssemblyString(text, error, context);
    if (!module) {
      ADD_FAILURE() << error.getMessage().str();
      return false;
    }
    module->setDataLayout(machine->createDataLayout());
    Function &function = *module->getFunction("f");
    run(function);
    EXPECT_FALSE(verifyModule(*module, &errs()));
    for (Instruction &instruction : instructions(function))
      if (auto *insert = dyn_cast<InsertElementInst>(&instruction))
        if (auto *load = dyn_cast<LoadInst>(insert->getOperand(1)))
          if (load->getParent() == insert->getParent() && load->hasOneUse())
            return true;
    return false;
  }

private:
  void run(Function &function) {
    LoopAnalysisManager loops;
    FunctionAnalysisManager functions;
    CGSCCAnalysisManager components;
    ModuleAnalysisManager modules;
    PassBuilder builder(machine.get());
    builder.registerModuleAnalyses(modules);
    builder.registerCGSCCAnalyses(components);
    builder.registerFunctionAnalyses(functions);
    builder.registerLoopAnalyses(loops);
    builder.crossRegisterProxies(loops, functions, components, modules);
    piko::BroadcastLoadsPass(*machine).run(function, functions);
  }

  LLVMContext context;
  std::unique_ptr<Module> module;
  std::unique_ptr<TargetMachine> machine;
};

const char *splatOf =
    "  %i = insertelement <4 x float> poison, float %x, i64 0\n"
    "  %s = shufflevector <4 x float> %i, <4 x float> poison, "
    "<4 x i32> zeroinitializer\n"
    "  %r = fmul <4 x float> %s, %v\n";

TEST_F(BroadcastLoads, OfAnotherBlock) {
  EXPECT_TRUE(isRepeated(std::string("  %x = load float, ptr %p\n"
                                     "  br i1 %c, label %yes, label %no\n"
                                     "yes:\n") +
                         splatOf +
                         "  ret <4 x float> %r\n"
                         "no:\n"
                         "  ret <4 x float> %v\n"));
}

TEST_F(BroadcastLoads, OfBothSides) {
  EXPECT_TRUE(
      isRepeated(std::string("  br i1 %c, label %yes, label %no\n"
                             "yes:\n"
                             "  %a = getelementptr i8, ptr %p, i64 8\n"
                             "  %b = load float, ptr %a\n"
                             "  br label %join\n"
                             "no:\n"
                             "  %d = getelementptr i8, ptr %p, i64 8\n"
                             "  %e = load float, ptr %d\n"
                             "  br label %join\n"
                             "join:\n"
                             "  %x = phi float [%b, %yes], [%e, %no]\n") +
                 splatOf + "  ret <4 x float> %r\n"));
}

TEST_F(BroadcastLoads, OfDifferentPlaces) {
  EXPECT_FALSE(
      isRepeated(std::string("  br i1 %c, label %yes, label %no\n"
                             "yes:\n"
                             "  %b = load float, ptr %p\n"
                             "  br label %join\n"
                             "no:\n"
                             "  %d = getelementptr i8, ptr %p, i64 8\n"
                             "  %e = load float, ptr %d\n"
                             "  br label %join\n"
                             "join:\n"
                             "  %x = phi float [%b, %yes], [%e, %no]\n") +
                 splatOf + "  ret <4 x float> %r\n"));
}

TEST_F(BroadcastLoads, OfAVectorsElement) {
  EXPECT_TRUE(isRepeated("  %two = load <2 x float>, ptr %p, align 4\n"
                         "  %s = shufflevector <2 x float> %two, <2 x float> "
                         "poison, <4 x i32> <i32 1, i32 1, i32 1, i32 1>\n"
                         "  %r = fmul <4 x float> %s, %v\n"
                         "  ret <4 x float> %r\n"));
}

TEST_F(BroadcastLoads, Negated) {
  EXPECT_TRUE(isRepeated(
      "  %y = load float, ptr %p\n"
      "  br i1 %c, label %yes, label %no\n"
      "yes:\n"
      "  %x = fneg float %y\n"
      "  %i = insertelement <4 x float> poison, float %x, i64 0\n"
      "  %s = shufflevector <4 x float> %i, <4 x float> poison, "
      "<4 x i32> zeroinitializer\n"
      "  %r = call <4 x float> @llvm.fma.v4f32(<4 x float> %s, <4 x float> %v, "
      "<4 x float> %v)\n"
      "  ret <4 x float> %r\n"
      "no:\n"
      "  ret <4 x float> %v\n"));
}

TEST_F(BroadcastLoads, WrittenInBetween) {
  EXPECT_FALSE(isRepeated(std::string("  %x = load float, ptr %p\n"
                                      "  br i1 %c, label %yes, label %no\n"
                                      "yes:\n"
                                      "  store float 1.0, ptr %q\n") +
                          splatOf +
                          "  ret <4 x float> %r\n"
                          "no:\n"
                          "  ret <4 x float> %v\n"));
}

TEST_F(BroadcastLoads, WrittenOnOneOfTheWays) {
  EXPECT_FALSE(isRepeated(std::string("  %x = load float, ptr %p\n"
                                      "  br i1 %c, label %yes, label %no\n"
                                      "yes:\n"
                                      "  store float 1.0, ptr %q\n"
                                      "  br label %no\n"
                                      "no:\n") +
                          splatOf + "  ret <4 x float> %r\n"));
}

TEST_F(BroadcastLoads, OfAnotherTurn) {
  EXPECT_FALSE(isRepeated(
      std::string("  br label %head\n"
                  "head:\n"
                  "  %old = phi float [0.0, %0], [%x, %body]\n"
                  "  %x = load float, ptr %p\n"
                  "  br label %body\n"
                  "body:\n"
                  "  %i = insertelement <4 x float> poison, float %old, i64 0\n"
                  "  %s = shufflevector <4 x float> %i, <4 x float> poison, "
                  "<4 x i32> zeroinitializer\n"
                  "  %r = fmul <4 x float> %s, %v\n"
                  "  store <4 x float> %r, ptr %q\n"
                  "  br i1 %c, label %head, label %end\n"
                  "end:\n"
                  "  ret <4 x float> %r\n")));
}

TEST_F(BroadcastLoads, InFrontOfALoop) {
  EXPECT_FALSE(isRepeated(std::string("  %x = load float, ptr %p\n"
                                      "  br label %body\n"
                                      "body:\n") +
                          splatOf +
                          "  br i1 %c, label %body, label %end\n"
                          "end:\n"
                          "  ret <4 x float> %r\n"));
}

} // namespace
