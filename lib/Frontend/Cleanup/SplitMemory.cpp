//===- SplitMemory.cpp - Copies and variables, number by number -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM's own SROA leaves copies of records that nobody reads field by field,
// and variables that are indexed, whole, and makes integers that span fields.
// Here the layout of either side of a copy says where its numbers are.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"

#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/Module.h"

using namespace piko;
using llvm::dyn_cast;

/// Copies of more numbers than this are not split, and rejected later on.
static constexpr int64_t unrollLimit = 4096;

namespace {

class MemorySplitter {
public:
  MemorySplitter(llvm::Function &function, MemoryMap &memory)
      : function(function), memory(memory), builder(function.getContext()) {}

  bool run() {
    for (llvm::Instruction &instruction :
         llvm::make_early_inc_range(llvm::instructions(function)))
      split(&instruction);
    llvm::SmallVector<llvm::AllocaInst *> variables;
    for (llvm::Instruction &instruction : function.getEntryBlock())
      if (auto *variable = dyn_cast<llvm::AllocaInst>(&instruction))
        variables.push_back(variable);
    for (llvm::AllocaInst *variable : variables)
      splitVariable(variable);
    return changed;
  }

private:
  void split(llvm::Instruction *instruction) {
    builder.SetInsertPoint(instruction);
    bool done = false;
    if (auto *copy = dyn_cast<llvm::MemTransferInst>(instruction))
      done = splitCopy(copy);
    else if (auto *fill = dyn_cast<llvm::MemSetInst>(instruction))
      done = splitFill(fill);
    else if (auto *load = dyn_cast<llvm::LoadInst>(instruction))
      done = splitLoad(load);
    else if (auto *store = dyn_cast<llvm::StoreInst>(instruction))
      done = splitStore(store);
    if (!done)
      return;
    instruction->eraseFromParent();
    changed = true;
  }

  llvm::Value *at(llvm::Value *pointer, int64_t offset) {
    return makeMemberAddress(builder, pointer, offset);
  }

  std::optional<llvm::SmallVector<MemoryPiece>> getPieces(llvm::Value *pointer,
                                                          int64_t size) {
    Address address = getAddress(pointer, memory.data);
    const MemoryLayout *layout = memory.getLayout(address.base);
    if (!layout)
      return std::nullopt;
    return piko::getPieces(*layout, address, size, unrollLimit);
  }

  bool splitCopy(llvm::MemTransferInst *copy) {
    auto *length = dyn_cast<llvm::ConstantInt>(copy->getLength());
    if (!length)
      return false;
    int64_t size = length->getZExtValue();
    auto pieces = getPieces(copy->getSource(), size);
    auto ours = getPieces(copy->getDest(), size);
    // Explicit padding makes more pieces than the other side knows of.
    if (!pieces || (ours && ours->size() < pieces->size()))
      pieces = ours;
    if (!pieces)
      return false;
    llvm::SmallVector<llvm::Value *> values;
    for (const MemoryPiece &piece : *pieces)
      values.push_back(
          builder.CreateLoad(piece.type, at(copy->getSource(), piece.offset)));
    for (auto [piece, value] : llvm::zip(*pieces, values))
      builder.CreateStore(value, at(copy->getDest(), piece.offset));
    return true;
  }

  bool splitFill(llvm::MemSetInst *fill) {
    auto *length = dyn_cast<llvm::ConstantInt>(fill->getLength());
    if (!length)
      return false;
    auto pieces = getPieces(fill->getDest(), length->getZExtValue());
    if (!pieces)
      return false;
    auto *byte = dyn_cast<llvm::ConstantInt>(fill->getValue());
    bool isZero = byte && byte->isZero();
    auto isPointer = [](const MemoryPiece &piece) {
      return piece.type->isPointerTy();
    };
    if (!isZero && llvm::any_of(*pieces, isPointer))
      return false;
    for (const MemoryPiece &piece : *pieces)
      builder.CreateStore(isZero ? llvm::Constant::getNullValue(piece.type)
                                 : repeatByte(builder, fill->getValue(),
                                              piece.type, memory.data),
                          at(fill->getDest(), piece.offset));
    return true;
  }

  bool splitLoad(llvm::LoadInst *load) {
    if (!load->getType()->isAggregateType())
      return false;
    load->replaceAllUsesWith(
        loadAggregate(load->getType(), load->getPointerOperand(), 0));
    return true;
  }

  llvm::Value *loadAggregate(llvm::Type *type, llvm::Value *pointer,
                             int64_t offset) {
    if (!type->isAggregateType())
      return builder.CreateLoad(type, at(pointer, offset));
    llvm::Value *whole = llvm::PoisonValue::get(type);
    for (unsigned i = 0, e = getElementCount(type); i < e; ++i) {
      llvm::Value *part =
          loadAggregate(llvm::ExtractValueInst::getIndexedType(type, i),
                        pointer, offset + getElementOffset(type, i));
      whole = builder.CreateInsertValue(whole, part, i);
    }
    return whole;
  }

  bool splitStore(llvm::StoreInst *store) {
    llvm::Value *value = store->getValueOperand();
    if (!value->getType()->isAggregateType())
      return false;
    storeAggregate(value, store->getPointerOperand(), 0);
    return true;
  }

  void storeAggregate(llvm::Value *value, llvm::Value *pointer,
                      int64_t offset) {
    llvm::Type *type = value->getType();
    if (!type->isAggregateType()) {
      builder.CreateStore(value, at(pointer, offset));
      return;
    }
    for (unsigned i = 0, e = getElementCount(type); i < e; ++i)
      storeAggregate(builder.CreateExtractValue(value, i), pointer,
                     offset + getElementOffset(type, i));
  }

  static unsigned getElementCount(llvm::Type *type) {
    if (auto *structure = dyn_cast<llvm::StructType>(type))
      return structure->getNumElements();
    return type->getArrayNumElements();
  }
  int64_t getElementOffset(llvm::Type *type, unsigned index) {
    if (auto *structure = dyn_cast<llvm::StructType>(type))
      return memory.data.getStructLayout(structure)->getElementOffset(index);
    return index * memory.data.getTypeAllocSize(type->getArrayElementType());
  }

  //===--------------------------------------------------------------------===//
  // Variables
  //===--------------------------------------------------------------------===//

  struct Use {
    llvm::Instruction *instruction;
    unsigned leaf;
  };

  std::optional<MemoryAccess> getAccess(const llvm::Instruction *instruction,
                                        const MemoryLayout &layout) {
    const llvm::Value *pointer = llvm::getLoadStorePointerOperand(instruction);
    return resolveAccess(
        layout, getAddress(const_cast<llvm::Value *>(pointer), memory.data),
        memory.data.getTypeStoreSize(llvm::getLoadStoreType(instruction)));
  }

  /// Finds all loads and stores of a variable; false if it is used otherwise,
  /// or if one of them is not of one number.
  bool collectUses(llvm::Value *pointer, const MemoryLayout &layout,
                   llvm::SmallVectorImpl<Use> &uses) {
    for (llvm::User *user : pointer->users()) {
      if (llvm::isa<llvm::GetElementPtrInst>(user)) {
        if (!collectUses(user, layout, uses))
          return false;
        continue;
      }
      llvm::Type *type = nullptr;
      if (auto *load = dyn_cast<llvm::LoadInst>(user))
        type = load->getType();
      else if (auto *store = dyn_cast<llvm::StoreInst>(user);
               store && store->getPointerOperand() == pointer)
        type = store->getValueOperand()->getType();
      if (!type || type->isAggregateType())
        return false;
      auto *use = llvm::cast<llvm::Instruction>(user);
      std::optional<MemoryAccess> access = getAccess(use, layout);
      if (!access)
        return false;
      bool isPointer = layout.leaves[access->leaf].type->isPointerTy();
      if (isPointer != type->isPointerTy())
        return false;
      uses.push_back({use, access->leaf});
    }
    return true;
  }

  void splitVariable(llvm::AllocaInst *variable) {
    llvm::Type *type = variable->getAllocatedType();
    if (!type->isAggregateType() || variable->isArrayAllocation())
      return;
    if (type->isArrayTy() && !type->getArrayElementType()->isAggregateType())
      return;
    const MemoryLayout &layout = memory.getTypeLayout(type);
    llvm::SmallVector<Use> uses;
    if (!collectUses(variable, layout, uses))
      return;

    builder.SetInsertPoint(variable);
    llvm::SmallVector<llvm::Value *> leaves(layout.leaves.size(), nullptr);
    for (const Use &use : uses) {
      llvm::Value *&leaf = leaves[use.leaf];
      if (leaf)
        continue;
      const MemoryLeaf &shape = layout.leaves[use.leaf];
      llvm::Type *leafType = shape.type;
      if (!shape.dimensions.empty())
        leafType = llvm::ArrayType::get(leafType, shape.getElementCount());
      llvm::AllocaInst *part =
          builder.CreateAlloca(leafType, nullptr, variable->getName());
      part->copyMetadata(*variable);
      leaf = part;
    }
    for (const Use &use : uses)
      rewriteUse(use, layout, leaves[use.leaf]);
    changed = true;
  }

  void rewriteUse(const Use &use, const MemoryLayout &layout,
                  llvm::Value *pointer) {
    const MemoryLeaf &leaf = layout.leaves[use.leaf];
    // Anew, since an index may be another number of this variable.
    MemoryAccess access = *getAccess(use.instruction, layout);
    builder.SetInsertPoint(use.instruction);
    if (!leaf.dimensions.empty()) {
      MemoryIndex linear;
      int64_t factor = 1;
      for (size_t d = leaf.dimensions.size(); d-- > 0;) {
        linear.constant += access.indices[d].constant * factor;
        for (auto [value, scale] : access.indices[d].terms)
          linear.terms.push_back({value, scale * factor});
        factor *= leaf.dimensions[d].count;
      }
      pointer = builder.CreateInBoundsGEP(leaf.type, pointer,
                                          linear.materialize(builder));
    }
    if (auto *load = dyn_cast<llvm::LoadInst>(use.instruction)) {
      llvm::Value *value = builder.CreateLoad(leaf.type, pointer);
      if (value->getType() != load->getType())
        value = builder.CreateBitCast(value, load->getType());
      load->replaceAllUsesWith(value);
    } else {
      llvm::Value *value =
          llvm::cast<llvm::StoreInst>(use.instruction)->getValueOperand();
      if (value->getType() != leaf.type)
        value = builder.CreateBitCast(value, leaf.type);
      builder.CreateStore(value, pointer);
    }
    use.instruction->eraseFromParent();
  }

  llvm::Function &function;
  MemoryMap &memory;
  llvm::IRBuilder<> builder;
  bool changed = false;
};

} // namespace

bool piko::splitMemory(llvm::Function &function, MemoryMap &memory) {
  return MemorySplitter(function, memory).run();
}
