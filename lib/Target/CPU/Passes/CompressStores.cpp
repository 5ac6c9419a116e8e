// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/CompressStores.h"

#include "Piko/Analysis/TargetModel.h"

#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/IntrinsicInst.h"

using namespace llvm;
using namespace piko;

/// Stores some lanes one after the other, and gives back where the next ones
/// go.
static Value *write(IRBuilder<> &builder, Value *lanes, Value *to,
                    MaybeAlign alignment, Value *mask) {
  auto *type = cast<FixedVectorType>(lanes->getType());
  unsigned count = type->getNumElements();
  Type *bits = builder.getIntNTy(count);
  Value *number = builder.CreateUnaryIntrinsic(
      Intrinsic::ctpop, builder.CreateBitCast(mask, bits));
  number = builder.CreateZExt(number, builder.getInt64Ty());
  Value *first =
      builder.CreateIntrinsic(Intrinsic::experimental_vector_compress, {type},
                              {lanes, mask, PoisonValue::get(type)});
  // As many low bits as lanes, of which there may be all.
  Value *below = builder.CreateNot(builder.CreateShl(
      ConstantInt::getAllOnesValue(builder.getInt64Ty()), number));
  Value *low =
      builder.CreateBitCast(builder.CreateTrunc(below, bits), mask->getType());
  builder.CreateMaskedStore(first, to, alignment.valueOrOne(), low);
  return builder.CreateGEP(type->getElementType(), to, number);
}

static void expand(IntrinsicInst *store) {
  IRBuilder<> builder(store);
  Value *lanes = store->getArgOperand(0), *to = store->getArgOperand(1),
        *mask = store->getArgOperand(2);
  auto *type = cast<FixedVectorType>(lanes->getType());
  int count = type->getNumElements(),
      most = widestVectorBits / type->getScalarSizeInBits();
  for (int begin = 0; begin < count; begin += most) {
    SmallVector<int> part;
    for (int lane = begin; lane < std::min(count, begin + most); ++lane)
      part.push_back(lane);
    to =
        write(builder, builder.CreateShuffleVector(lanes, part), to,
              store->getParamAlign(1), builder.CreateShuffleVector(mask, part));
  }
  store->eraseFromParent();
}

bool piko::CompressStoresPass::change(Function &function,
                                      FunctionAnalysisManager &) {
  // An instruction is one of 32 or 64 bits for each lane.
  SmallVector<IntrinsicInst *> stores;
  for (Instruction &instruction : instructions(function)) {
    auto *store = dyn_cast<IntrinsicInst>(&instruction);
    if (!store || store->getIntrinsicID() != Intrinsic::masked_compressstore)
      continue;
    unsigned width = store->getArgOperand(0)->getType()->getScalarSizeInBits();
    if (width == 32 || width == 64)
      stores.push_back(store);
  }
  for (IntrinsicInst *store : stores)
    expand(store);
  return !stores.empty();
}
