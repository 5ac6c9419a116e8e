// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Target/KeepZeros.h"

#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/PatternMatch.h"

using namespace llvm;

/// Whether a choice is the smaller or the larger one of two numbers, or of two
/// vectors of them, and both may be zero.
static bool isMinMax(const SelectInst &choice) {
  auto *test = dyn_cast<FCmpInst>(choice.getCondition());
  if (!test || !choice.getType()->isFPOrFPVectorTy())
    return false;
  const Value *a = test->getOperand(0), *b = test->getOperand(1),
              *first = choice.getTrueValue(), *second = choice.getFalseValue();
  auto isNonZero = [](const Value *value) {
    return PatternMatch::match(value, PatternMatch::m_NonZeroFP());
  };
  return ((a == first && b == second) || (a == second && b == first)) &&
         !isNonZero(a) && !isNonZero(b);
}

PreservedAnalyses piko::KeepZerosPass::run(Function &function,
                                           FunctionAnalysisManager &) {
  SmallVector<SelectInst *> choices;
  for (Instruction &each : instructions(function))
    if (auto *choice = dyn_cast<SelectInst>(&each); choice && isMinMax(*choice))
      choices.push_back(choice);
  for (SelectInst *choice : choices) {
    IRBuilder<> builder(choice);
    Type *type = choice->getType(),
         *bits = type->getWithNewType(
             builder.getIntNTy(type->getScalarSizeInBits()));
    Value *chosen = builder.CreateSelect(
        choice->getCondition(),
        builder.CreateBitCast(choice->getTrueValue(), bits),
        builder.CreateBitCast(choice->getFalseValue(), bits));
    choice->replaceAllUsesWith(builder.CreateBitCast(chosen, type));
    choice->eraseFromParent();
  }
  return choices.empty() ? PreservedAnalyses::all() : PreservedAnalyses::none();
}
