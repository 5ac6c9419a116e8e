// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/StoreLanes.h"

#include "llvm/ADT/MapVector.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/Instructions.h"

using namespace llvm;

static constexpr unsigned together = 64;

/// Lanes of one vector that are stored in one block.
using Stores = SmallVector<std::pair<StoreInst *, uint64_t>>;

/// The lane of a vector that is stored, and the vector.
static std::optional<std::pair<Value *, uint64_t>> findLane(StoreInst &store) {
  auto *extract = dyn_cast<ExtractElementInst>(store.getValueOperand());
  if (!extract || !store.isSimple())
    return std::nullopt;
  auto *type = dyn_cast<FixedVectorType>(extract->getVectorOperandType());
  auto *lane = dyn_cast<ConstantInt>(extract->getIndexOperand());
  bool isNarrow =
      type && type->getElementType()->isIntegerTy() &&
      (type->getScalarSizeInBits() == 8 || type->getScalarSizeInBits() == 16);
  if (!isNarrow || !lane || lane->uge(type->getNumElements()) ||
      type->getPrimitiveSizeInBits() % together != 0)
    return std::nullopt;
  return std::pair(extract->getVectorOperand(), lane->getZExtValue());
}

/// Takes groups of lanes out of the vector before the first store.
static void replace(Value *vector, const Stores &stores) {
  auto *type = cast<FixedVectorType>(vector->getType());
  uint64_t bits = type->getScalarSizeInBits(), count = together / bits;
  StoreInst *first = stores.front().first;
  IRBuilder<> builder(first);
  Value *groups = builder.CreateBitCast(
      vector, FixedVectorType::get(builder.getInt64Ty(),
                                   type->getNumElements() / count));
  DenseMap<uint64_t, Value *> known;
  for (auto [store, lane] : stores) {
    Value *&group = known[lane / count];
    if (!group) {
      builder.SetInsertPoint(first);
      group = builder.CreateExtractElement(groups, lane / count);
    }
    builder.SetInsertPoint(store);
    Value *number = builder.CreateLShr(group, lane % count * bits);
    auto *extract = cast<Instruction>(store->getValueOperand());
    store->setOperand(0, builder.CreateTrunc(number, type->getElementType()));
    if (extract->use_empty())
      extract->eraseFromParent();
  }
}

bool piko::StoreLanesPass::change(Function &function,
                                  FunctionAnalysisManager &) {
  constexpr size_t least = 8;
  bool isChanged = false;
  for (BasicBlock &block : function) {
    MapVector<Value *, Stores> vectors;
    for (Instruction &instruction : block)
      if (auto *store = dyn_cast<StoreInst>(&instruction))
        if (auto lane = findLane(*store))
          vectors[lane->first].emplace_back(store, lane->second);
    for (auto &[vector, stores] : vectors)
      if (stores.size() >= least) {
        replace(vector, stores);
        isChanged = true;
      }
  }
  return isChanged;
}
