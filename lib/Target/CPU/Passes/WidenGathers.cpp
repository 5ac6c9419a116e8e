// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/WidenGathers.h"

#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/Module.h"
#include "llvm/IR/PatternMatch.h"

using namespace llvm;

static constexpr unsigned wordBytes = 4, byteBits = 8;

/// Whether no number that it gathers lies in two words.
static bool isNarrow(IntrinsicInst *gather) {
  auto *type = dyn_cast<FixedVectorType>(gather->getType());
  if (!type || type->getNumElements() < 4)
    return false;
  unsigned bits = type->getScalarSizeInBits();
  return bits == byteBits ||
         (bits == 2 * byteBits && gather->getParamAlign(0).valueOrOne() >= 2);
}

static void widen(IntrinsicInst *gather) {
  IRBuilder<> builder(gather);
  Value *pointers = gather->getArgOperand(0), *mask = gather->getArgOperand(1),
        *otherwise = gather->getArgOperand(2);
  Type *type = gather->getType();
  ElementCount lanes = cast<VectorType>(type)->getElementCount();
  auto *words = VectorType::get(builder.getInt32Ty(), lanes);
  auto *bits =
      VectorType::get(builder.getIntNTy(type->getScalarSizeInBits()), lanes);
  const DataLayout &layout = gather->getModule()->getDataLayout();
  auto *addresses = cast<VectorType>(layout.getIntPtrType(pointers->getType()));
  Value *address = builder.CreatePtrToInt(pointers, addresses);
  Value *aligned = builder.CreateIntToPtr(
      builder.CreateAnd(address,
                        ConstantInt::getSigned(addresses, -int64_t(wordBytes))),
      pointers->getType());
  Value *word = builder.CreateMaskedGather(words, aligned, Align(wordBytes),
                                           mask, Constant::getNullValue(words));
  Value *shift = builder.CreateShl(
      builder.CreateAnd(builder.CreateTrunc(address, words), wordBytes - 1), 3);
  Value *value = builder.CreateBitCast(
      builder.CreateTrunc(builder.CreateLShr(word, shift), bits), type);
  if (!match(otherwise, PatternMatch::m_Zero()) && !isa<UndefValue>(otherwise))
    value = builder.CreateSelect(mask, value, otherwise);
  gather->replaceAllUsesWith(value);
  gather->eraseFromParent();
}

bool piko::WidenGathersPass::change(Function &function,
                                    FunctionAnalysisManager &) {
  SmallVector<IntrinsicInst *> gathers;
  for (Instruction &instruction : instructions(function))
    if (auto *call = dyn_cast<IntrinsicInst>(&instruction);
        call && call->getIntrinsicID() == Intrinsic::masked_gather &&
        isNarrow(call))
      gathers.push_back(call);
  for (IntrinsicInst *gather : gathers)
    widen(gather);
  return !gathers.empty();
}
