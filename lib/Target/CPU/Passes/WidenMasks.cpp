// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/WidenMasks.h"

#include "llvm/ADT/MapVector.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/PatternMatch.h"

using namespace llvm;

static bool isMask(Type *type) {
  auto *vector = dyn_cast<FixedVectorType>(type);
  return vector && vector->getNumElements() == 8 &&
         vector->getElementType()->isIntegerTy(1);
}

static Type *getWide(Type *mask) {
  return FixedVectorType::get(Type::getInt32Ty(mask->getContext()), 8);
}

/// The block that an operand must be known in.
static BasicBlock *getBlock(const Use &use) {
  auto *user = cast<Instruction>(use.getUser());
  auto *phi = dyn_cast<PHINode>(user);
  return phi ? phi->getIncomingBlock(use) : user->getParent();
}

/// Hands the wide form of a mask to the blocks that use it.
static void spread(Instruction *mask, Value *wide) {
  MapVector<BasicBlock *, SmallVector<Use *>> uses;
  for (Use &use : mask->uses())
    if (use.getUser() != wide && getBlock(use) != mask->getParent())
      uses[getBlock(use)].push_back(&use);
  for (auto &[block, places] : uses) {
    IRBuilder<> builder(block, block->getFirstInsertionPt());
    Value *narrow =
        builder.CreateICmpSLT(wide, Constant::getNullValue(wide->getType()));
    for (Use *use : places)
      use->set(narrow);
  }
}

/// A phi of the wide form, and the mask after it.
static void widen(PHINode *phi) {
  IRBuilder<> builder(phi);
  PHINode *wide =
      builder.CreatePHI(getWide(phi->getType()), phi->getNumIncomingValues());
  for (auto [value, block] : zip(phi->incoming_values(), phi->blocks())) {
    builder.SetInsertPoint(block->getTerminator());
    wide->addIncoming(builder.CreateSExt(value, wide->getType()), block);
  }
  BasicBlock *block = phi->getParent();
  builder.SetInsertPoint(block, block->getFirstInsertionPt());
  auto *mask = cast<Instruction>(
      builder.CreateICmpSLT(wide, Constant::getNullValue(wide->getType())));
  phi->replaceAllUsesWith(mask);
  phi->eraseFromParent();
  spread(mask, wide);
}

/// A choice between a mask and none, as lanes that go on have it, where `and`
/// is one instruction: what is chosen may be poison where it is not.
static bool makeConjunctions(Function &function) {
  SmallVector<SelectInst *> selects;
  for (Instruction &instruction : instructions(function)) {
    auto *select = dyn_cast<SelectInst>(&instruction);
    if (select && isMask(select->getType()) &&
        isMask(select->getCondition()->getType()) &&
        match(select->getFalseValue(), PatternMatch::m_Zero()))
      selects.push_back(select);
  }
  for (SelectInst *select : selects) {
    IRBuilder<> builder(select);
    select->replaceAllUsesWith(builder.CreateAnd(
        select->getCondition(), builder.CreateFreeze(select->getTrueValue())));
    select->eraseFromParent();
  }
  return !selects.empty();
}

bool piko::WidenMasksPass::change(Function &function,
                                  FunctionAnalysisManager &) {
  bool isChanged = makeConjunctions(function);
  SmallVector<PHINode *> phis;
  SmallVector<Instruction *> masks;
  for (Instruction &instruction : instructions(function)) {
    if (!isMask(instruction.getType()))
      continue;
    if (auto *phi = dyn_cast<PHINode>(&instruction))
      phis.push_back(phi);
    else if (any_of(instruction.uses(), [&](const Use &use) {
               return getBlock(use) != instruction.getParent();
             }))
      masks.push_back(&instruction);
  }
  for (Instruction *mask : masks) {
    IRBuilder<> builder(mask->getNextNode());
    spread(mask, builder.CreateSExt(mask, getWide(mask->getType())));
  }
  for (PHINode *phi : phis)
    widen(phi);
  return isChanged || !masks.empty() || !phis.empty();
}
