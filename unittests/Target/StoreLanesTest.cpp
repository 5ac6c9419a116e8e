// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Narrow numbers that lanes store are taken out of their vector together.

#include "Passes/StoreLanes.h"
#include "PassTest.h"

#include "llvm/IR/InstIterator.h"

using namespace llvm;

namespace {

class StoreLanes : public PassTest {
protected:
  /// How many numbers are taken out of a vector of such a type, of whose lanes
  /// the first ones are stored.
  int countExtracts(StringRef type, int stored) {
    std::string text =
        "define void @f(ptr %p, <16 x " + type.str() + "> %v) {\n";
    for (int lane = 0; lane < stored; ++lane) {
      std::string n = std::to_string(lane);
      text += "  %x" + n + " = extractelement <16 x " + type.str() +
              "> %v, i64 " + n + "\n";
      text += "  %p" + n + " = getelementptr [8 x i8], ptr %p, i64 " + n + "\n";
      text += "  store " + type.str() + " %x" + n + ", ptr %p" + n + "\n";
    }
    text += "  ret void\n}\n";
    int extracts = 0;
    if (Function *function = run<piko::StoreLanesPass>(text))
      for (Instruction &instruction : instructions(*function))
        extracts += isa<ExtractElementInst>(instruction);
    return extracts;
  }
};

TEST_F(StoreLanes, OfEightAndSixteenBits) {
  EXPECT_EQ(countExtracts("i8", 16), 2);
  EXPECT_EQ(countExtracts("i16", 16), 4);
}

TEST_F(StoreLanes, OfSomeLanes) { EXPECT_EQ(countExtracts("i16", 9), 3); }

TEST_F(StoreLanes, OfFewLanes) { EXPECT_EQ(countExtracts("i16", 7), 7); }

TEST_F(StoreLanes, OfWiderNumbers) { EXPECT_EQ(countExtracts("i32", 16), 16); }

} // namespace
