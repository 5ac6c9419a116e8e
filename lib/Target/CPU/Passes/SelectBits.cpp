// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/SelectBits.h"

#include "llvm/Analysis/LoopInfo.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/PatternMatch.h"

using namespace llvm;
using namespace llvm::PatternMatch;

/// Whether code generation would make a branch of a select that no processor
/// predicts.
static bool needsBits(SelectInst &select, const LoopInfo &loops) {
  Type *type = select.getType();
  if (!type->isFloatTy() && !type->isDoubleTy())
    return false;
  Value *condition = select.getCondition();
  if (isa<FCmpInst, Constant>(condition) ||
      select.hasMetadata(LLVMContext::MD_prof))
    return false;
  // A table of two constants is indexed.
  if (isa<Constant>(select.getTrueValue()) &&
      isa<Constant>(select.getFalseValue()))
    return false;
  const Loop *loop = loops.getLoopFor(select.getParent());
  return loop && !loop->isLoopInvariant(condition);
}

static Value *selectBits(SelectInst &select) {
  IRBuilder<> builder(&select);
  Type *bits = builder.getIntNTy(select.getType()->getPrimitiveSizeInBits());
  Value *condition = select.getCondition(), *left = select.getTrueValue(),
        *right = select.getFalseValue();
  bool isLeft = match(left, m_FNeg(m_Specific(right)));
  if (isLeft || match(right, m_FNeg(m_Specific(left)))) {
    auto *sign =
        ConstantInt::get(bits, APInt::getSignMask(bits->getIntegerBitWidth()));
    auto *none = ConstantInt::get(bits, 0);
    return builder.CreateXor(builder.CreateBitCast(isLeft ? right : left, bits),
                             builder.CreateSelect(condition,
                                                  isLeft ? sign : none,
                                                  isLeft ? none : sign));
  }
  return builder.CreateSelect(condition, builder.CreateBitCast(left, bits),
                              builder.CreateBitCast(right, bits));
}

PreservedAnalyses piko::SelectBitsPass::run(Function &function,
                                            FunctionAnalysisManager &analyses) {
  const LoopInfo &loops = analyses.getResult<LoopAnalysis>(function);
  SmallVector<SelectInst *> selects;
  for (Instruction &instruction : instructions(function))
    if (auto *select = dyn_cast<SelectInst>(&instruction);
        select && needsBits(*select, loops))
      selects.push_back(select);
  for (SelectInst *select : selects) {
    IRBuilder<> builder(select);
    Value *result = selectBits(*select);
    builder.SetInsertPoint(select);
    select->replaceAllUsesWith(
        builder.CreateBitCast(result, select->getType()));
    select->eraseFromParent();
  }
  if (selects.empty())
    return PreservedAnalyses::all();
  PreservedAnalyses preserved;
  preserved.preserveSet<CFGAnalyses>();
  return preserved;
}
