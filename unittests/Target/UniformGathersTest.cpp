// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Gathers from one place become one masked load; others stay.

#include "Passes/UniformGathers.h"
#include "PassTest.h"

#include "llvm/IR/InstIterator.h"
#include "llvm/IR/IntrinsicInst.h"

using namespace llvm;

namespace {

class UniformGathers : public PassTest {
protected:
  /// How many calls of an intrinsic are left of a gather from these pointers.
  std::pair<int, int> countGathersAndLoads(StringRef pointers,
                                           StringRef otherwise = "poison") {
    std::string text = "define <4 x float> @f(ptr %p, <4 x i64> %at, "
                       "<4 x i1> %m, <4 x float> %v) {\n";
    text += pointers;
    text += "  %r = call <4 x float> @llvm.masked.gather.v4f32.v4p0(<4 x ptr> "
            "align 4 %ps, <4 x i1> %m, <4 x float> ";
    text += otherwise;
    text += ")\n  ret <4 x float> %r\n}\n"
            "declare <4 x float> @llvm.masked.gather.v4f32.v4p0(<4 x ptr>, "
            "<4 x i1>, <4 x float>)\n";
    Function *function = run<piko::UniformGathersPass>(text);
    int gathers = 0, loads = 0;
    if (function)
      for (Instruction &instruction : instructions(*function))
        if (auto *call = dyn_cast<IntrinsicInst>(&instruction)) {
          gathers += call->getIntrinsicID() == Intrinsic::masked_gather;
          loads += call->getIntrinsicID() == Intrinsic::masked_load;
        }
    if (function)
      result = function->back().getTerminator()->getOperand(0);
    return {gathers, loads};
  }

  Value *result = nullptr; ///< of the function
};

const char *onePlace =
    "  %i = insertelement <4 x ptr> poison, ptr %p, i64 0\n"
    "  %ps = shufflevector <4 x ptr> %i, <4 x ptr> poison, <4 x i32> "
    "zeroinitializer\n";

TEST_F(UniformGathers, OfOnePlace) {
  EXPECT_EQ(countGathersAndLoads(onePlace), std::pair(0, 1));
}

/// Lanes that are not active have the other vector's numbers.
TEST_F(UniformGathers, KeepsOtherLanes) {
  EXPECT_EQ(countGathersAndLoads(onePlace, "%v"), std::pair(0, 1));
  auto *choice = dyn_cast_or_null<SelectInst>(result);
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->getCondition()->getName(), "m");
  EXPECT_EQ(choice->getFalseValue()->getName(), "v");
}

TEST_F(UniformGathers, OfDifferentPlaces) {
  EXPECT_EQ(countGathersAndLoads(
                "  %ps = getelementptr float, ptr %p, <4 x i64> %at\n"),
            std::pair(1, 0));
}

} // namespace
