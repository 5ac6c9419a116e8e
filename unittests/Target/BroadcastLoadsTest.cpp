// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which loads are repeated where they are broadcast, and which may not be.

#include "Passes/BroadcastLoads.h"

#include "PassTest.h"

#include "llvm/IR/InstIterator.h"

using namespace llvm;

namespace {

class BroadcastLoads : public PassTest {
protected:
  /// Runs the pass on the body of a function of a pointer, a flag, a vector and
  /// another pointer, and says whether a load is right before the splat's
  /// insertion, as selection needs it.
  bool isRepeated(StringRef body) {
    std::string text =
        "define <4 x float> @f(ptr %p, i1 %c, <4 x float> %v, ptr %q) {\n";
    text += body;
    text += "}\ndeclare <4 x float> @llvm.fma.v4f32(<4 x float>, "
            "<4 x float>, <4 x float>)\n";
    Function *function = run<piko::BroadcastLoadsPass>(text);
    if (!function)
      return false;
    for (Instruction &instruction : instructions(*function))
      if (auto *insert = dyn_cast<InsertElementInst>(&instruction))
        if (auto *load = dyn_cast<LoadInst>(insert->getOperand(1)))
          if (load->getParent() == insert->getParent() && load->hasOneUse())
            return true;
    return false;
  }
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
