// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Gathers of words side by side become loads of four words and transpositions.

#include "Passes/TransposeGathers.h"
#include "PassTest.h"

#include "llvm/IR/InstIterator.h"
#include "llvm/IR/IntrinsicInst.h"

using namespace llvm;

namespace {

class TransposeGathers : public PassTest {
protected:
  struct Counts {
    int gathers = 0, loads = 0;
    bool operator==(const Counts &other) const = default;
  };

  /// What is left of gathers of 8 lanes from records of 64 bytes, whose offsets
  /// these are, all but the first one after some other text.
  Counts count(ArrayRef<int> offsets, StringRef between = "",
               StringRef mask = "splat (i1 true)") {
    std::string text = "define <8 x float> @f(ptr %p, <8 x i64> %at, "
                       "<8 x i1> %m) {\n"
                       "  %s0 = freeze <8 x float> zeroinitializer\n";
    for (auto [i, offset] : enumerate(offsets)) {
      std::string n = std::to_string(i), next = std::to_string(i + 1);
      if (i == 1)
        text += between;
      text +=
          "  %r" + n + " = getelementptr [64 x i8], ptr %p, <8 x i64> %at\n";
      text += "  %a" + n + " = getelementptr i8, <8 x ptr> %r" + n + ", i64 " +
              std::to_string(offset) + "\n";
      text += "  %g" + n +
              " = call <8 x float> @llvm.masked.gather.v8f32.v8p0(<8 x ptr> "
              "align 4 %a" +
              n + ", <8 x i1> " + mask.str() +
              ", <8 x float> zeroinitializer)\n";
      text += "  %s" + next + " = fadd <8 x float> %s" + n + ", %g" + n + "\n";
    }
    text += "  ret <8 x float> %s" + std::to_string(offsets.size()) + "\n}\n";
    text += "declare <8 x float> @llvm.masked.gather.v8f32.v8p0(<8 x ptr>, "
            "<8 x i1>, <8 x float>)\n";
    Counts counts;
    if (Function *function = run<piko::TransposeGathersPass>(text))
      for (Instruction &instruction : instructions(*function)) {
        auto *call = dyn_cast<IntrinsicInst>(&instruction);
        counts.gathers +=
            call && call->getIntrinsicID() == Intrinsic::masked_gather;
        counts.loads += isa<LoadInst>(instruction);
      }
    return counts;
  }
};

TEST_F(TransposeGathers, OfFourWords) {
  EXPECT_EQ(count({0, 4, 8, 12}), (Counts{0, 8}));
  EXPECT_EQ(count({12, 4, 0, 8}), (Counts{0, 8}));
}

TEST_F(TransposeGathers, OfSeveralPieces) {
  EXPECT_EQ(count({0, 4, 8, 12, 16, 20, 24, 28}), (Counts{0, 16}));
}

/// What is loaded begins and ends with words that lanes load anyway.
TEST_F(TransposeGathers, KeepsWithinWhatIsLoaded) {
  EXPECT_EQ(count({0, 4, 8}), (Counts{3, 0}));
  EXPECT_EQ(count({0, 8, 12}), (Counts{0, 8}));
  EXPECT_EQ(count({0, 4, 16}), (Counts{3, 0}));
}

/// A piece may end where the words do, and begin with one that is known.
TEST_F(TransposeGathers, EndsWithTheLastWord) {
  EXPECT_EQ(count({0, 4, 8, 12, 16}), (Counts{1, 8}));
  EXPECT_EQ(count({0, 4, 8, 12, 16, 20, 24}), (Counts{0, 16}));
}

TEST_F(TransposeGathers, OfSomeLanes) {
  EXPECT_EQ(count({0, 4, 8, 12}, "", "%m"), (Counts{4, 0}));
}

TEST_F(TransposeGathers, AroundAWrite) {
  EXPECT_EQ(count({0, 4, 8, 12}, "  store i32 0, ptr %p\n"), (Counts{4, 0}));
}

TEST_F(TransposeGathers, OfOneWordTwice) {
  EXPECT_EQ(count({0, 4, 4, 8, 12, 0}), (Counts{0, 8}));
}

} // namespace
