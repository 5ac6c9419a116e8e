// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/UniformGathers.h"

#include "llvm/Analysis/VectorUtils.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/IntrinsicInst.h"

using namespace llvm;

namespace {

/// Masks with only the first lane, which holds if any does of another mask.
class FirstLanes {
public:
  Value *get(Value *mask, Instruction *user);

private:
  DenseMap<std::pair<Value *, BasicBlock *>, Value *> known;
};

} // namespace

Value *FirstLanes::get(Value *mask, Instruction *user) {
  Value *&first = known[{mask, user->getParent()}];
  if (first)
    return first;
  IRBuilder<> builder(user);
  auto *type = cast<FixedVectorType>(mask->getType());
  Value *bits =
      builder.CreateBitCast(mask, builder.getIntNTy(type->getNumElements()));
  return first = builder.CreateInsertElement(Constant::getNullValue(type),
                                             builder.CreateIsNotNull(bits),
                                             uint64_t(0));
}

/// Instructions load 32 and 64 bits of a lane under a mask.
static bool isMaskedWidth(Type *lanes) {
  unsigned bits = lanes->getScalarSizeInBits();
  return bits == 32 || bits == 64;
}

static void replace(IntrinsicInst *gather, Value *place, FirstLanes &lanes) {
  Value *mask = gather->getArgOperand(1), *others = gather->getArgOperand(2);
  Value *first = lanes.get(mask, gather);
  IRBuilder<> builder(gather);
  auto *type = cast<FixedVectorType>(gather->getType());
  CallInst *load = builder.CreateMaskedLoad(
      type, place, gather->getParamAlign(0).valueOrOne(), first,
      Constant::getNullValue(type));
  load->setAAMetadata(gather->getAAMetadata());
  SmallVector<int> all(type->getNumElements(), 0);
  Value *value = builder.CreateShuffleVector(load, all);
  if (!isa<UndefValue>(others))
    value = builder.CreateSelect(mask, value, others);
  gather->replaceAllUsesWith(value);
  gather->eraseFromParent();
}

bool piko::UniformGathersPass::change(Function &function,
                                      FunctionAnalysisManager &) {
  SmallVector<std::pair<IntrinsicInst *, Value *>> gathers;
  for (Instruction &instruction : instructions(function)) {
    auto *gather = dyn_cast<IntrinsicInst>(&instruction);
    if (!gather || gather->getIntrinsicID() != Intrinsic::masked_gather ||
        !isMaskedWidth(gather->getType()))
      continue;
    if (Value *place = getSplatValue(gather->getArgOperand(0)))
      gathers.emplace_back(gather, place);
  }
  FirstLanes lanes;
  for (auto [gather, place] : gathers)
    replace(gather, place, lanes);
  return !gathers.empty();
}
