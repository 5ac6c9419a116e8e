//===- FlattenPointers.cpp - Phis and selects of pointers -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A reference that may be to one of several things, such as std::max returns,
// becomes the number of the thing: each access branches on it. A pointer that
// walks through an array becomes an index, and pointers into one array are
// compared and subtracted as offsets.
//
//===----------------------------------------------------------------------===//

#include "Cleanup.h"

#include "llvm/ADT/SetVector.h"
#include "llvm/Analysis/CFG.h"
#include "llvm/IR/Dominators.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/Transforms/Utils/BasicBlockUtils.h"
#include "llvm/Transforms/Utils/Local.h"
#include "llvm/Transforms/Utils/SSAUpdater.h"

#include <numeric>

using namespace piko;
using llvm::dyn_cast;

/// A reference to one of more things than this is an error.
static constexpr size_t targetLimit = 64;

namespace {

class PointerFlattener {
public:
  PointerFlattener(llvm::Function &function, MemoryMap &memory)
      : function(function), memory(memory), builder(function.getContext()) {}

  bool run() {
    dominance.recalculate(function);
    llvm::SmallVector<llvm::WeakVH> choices, comparisons;
    for (llvm::Instruction &instruction : llvm::instructions(function)) {
      if (isChoice(&instruction))
        choices.push_back(&instruction);
      else if (llvm::isa<llvm::ICmpInst>(instruction) ||
               instruction.getOpcode() == llvm::Instruction::Sub)
        comparisons.push_back(&instruction);
    }
    for (llvm::WeakVH &choice : choices)
      if (auto *phi = dyn_cast_or_null<llvm::PHINode>(choice))
        makeIndex(phi);
    for (llvm::WeakVH &comparison : comparisons)
      if (auto *instruction = dyn_cast_or_null<llvm::Instruction>(comparison))
        compareOffsets(instruction);
    llvm::SmallPtrSet<llvm::Value *, 8> done;
    for (llvm::WeakVH &choice : choices)
      if (auto *instruction = dyn_cast_or_null<llvm::Instruction>(choice))
        if (done.insert(instruction).second)
          makeTags(instruction, done);
    for (llvm::WeakVH &choice : choices)
      if (auto *phi = dyn_cast_or_null<llvm::PHINode>(choice))
        llvm::RecursivelyDeleteDeadPHINode(phi);
    return changed;
  }

private:
  static bool isChoice(const llvm::Value *value) {
    return value->getType()->isPointerTy() &&
           llvm::isa<llvm::PHINode, llvm::SelectInst>(value);
  }

  //===--------------------------------------------------------------------===//
  // Pointers that walk
  //===--------------------------------------------------------------------===//

  void makeIndex(llvm::PHINode *phi) {
    llvm::Value *begin = nullptr;
    llvm::SmallVector<std::optional<int64_t>> steps;
    int64_t unit = 0;
    for (llvm::Value *incoming : phi->incoming_values()) {
      Address address = getAddress(incoming, memory.data);
      if (address.base == phi) {
        if (!address.terms.empty() || address.offset == 0)
          return;
        steps.push_back(address.offset);
        unit = std::gcd(unit, std::abs(address.offset));
        continue;
      }
      if (begin && begin != incoming)
        return;
      begin = incoming;
      steps.push_back(std::nullopt);
    }
    if (!begin || unit == 0)
      return;
    if (auto *definition = dyn_cast<llvm::Instruction>(begin))
      if (!dominance.dominates(definition, phi->getParent()))
        return;
    builder.SetInsertPoint(phi);
    llvm::PHINode *index =
        builder.CreatePHI(builder.getInt64Ty(), phi->getNumIncomingValues());
    for (auto [number, step] : llvm::enumerate(steps)) {
      llvm::BasicBlock *from = phi->getIncomingBlock(number);
      llvm::Value *value = builder.getInt64(0);
      if (step) {
        builder.SetInsertPoint(from->getTerminator());
        value = builder.CreateAdd(index, builder.getInt64(*step / unit));
      }
      index->addIncoming(value, from);
    }
    builder.SetInsertPoint(phi->getParent(),
                           phi->getParent()->getFirstInsertionPt());
    llvm::Value *pointer = builder.CreateGEP(
        llvm::ArrayType::get(builder.getInt8Ty(), unit), begin, index);
    phi->replaceAllUsesWith(pointer);
    phi->eraseFromParent();
    changed = true;
  }

  llvm::Value *makeOffset(const Address &address) {
    MemoryIndex offset{address.offset, {}};
    for (auto [value, scale] : address.terms)
      offset.terms.push_back({value, scale});
    return offset.materialize(builder);
  }

  void compareOffsets(llvm::Instruction *instruction) {
    llvm::Value *left = instruction->getOperand(0);
    llvm::Value *right = instruction->getOperand(1);
    auto *comparison = dyn_cast<llvm::ICmpInst>(instruction);
    if (!comparison) {
      auto *from = dyn_cast<llvm::PtrToIntInst>(left);
      auto *what = dyn_cast<llvm::PtrToIntInst>(right);
      if (!from || !what)
        return;
      left = from->getPointerOperand();
      right = what->getPointerOperand();
    }
    if (!left->getType()->isPointerTy())
      return;
    Address a = getAddress(left, memory.data);
    Address b = getAddress(right, memory.data);
    if (a.base != b.base)
      return;
    builder.SetInsertPoint(instruction);
    llvm::Value *x = makeOffset(a), *y = makeOffset(b);
    llvm::Value *result =
        comparison ? builder.CreateICmp(comparison->getSignedPredicate(), x, y)
                   : builder.CreateSExtOrTrunc(builder.CreateSub(x, y),
                                               instruction->getType());
    instruction->replaceAllUsesWith(result);
    instruction->eraseFromParent();
    changed = true;
  }

  //===--------------------------------------------------------------------===//
  // References to one of several things
  //===--------------------------------------------------------------------===//

  struct Access {
    llvm::Instruction *instruction;
    llvm::Value *choice;
    /// From the choice to the access, the last step first.
    llvm::SmallVector<llvm::GetElementPtrInst *> steps;
  };

  void makeTags(llvm::Instruction *first,
                llvm::SmallPtrSet<llvm::Value *, 8> &done) {
    // All choices that lead to this one, and what they choose from.
    llvm::SetVector<llvm::Value *> choices, targets;
    choices.insert(first);
    for (size_t i = 0; i < choices.size(); ++i) {
      auto *choice = llvm::cast<llvm::User>(choices[i]);
      unsigned begin = llvm::isa<llvm::SelectInst>(choice) ? 1 : 0;
      for (llvm::Value *operand : llvm::drop_begin(choice->operands(), begin))
        (isChoice(operand) ? choices : targets).insert(operand);
    }
    if (targets.size() > targetLimit)
      return;
    for (llvm::Value *target : targets) {
      Address address = getAddress(target, memory.data);
      if (!isChoice(address.base))
        continue;
      // A member of one of several things: next time one of several members.
      if (!choices.contains(address.base))
        distribute(target);
      return;
    }

    llvm::SmallVector<Access> accesses;
    for (llvm::Value *choice : choices) {
      done.insert(choice);
      collectAccesses(choice, choice, {}, accesses);
    }
    llvm::erase_if(accesses, [&](const Access &access) {
      return !llvm::all_of(targets, [&](llvm::Value *target) {
        return isAvailable(target, access);
      });
    });
    if (accesses.empty())
      return;
    std::map<llvm::Value *, llvm::Value *> tags =
        makeTagValues(choices, targets);
    for (const Access &access : accesses)
      rewrite(access, tags[access.choice], targets.getArrayRef());
    changed = true;
  }

  /// gep (phi a, b) -> phi (gep a), (gep b), for the step nearest to the
  /// choice.
  void distribute(llvm::Value *target) {
    auto *step = dyn_cast<llvm::GetElementPtrInst>(target);
    while (step && !isChoice(step->getPointerOperand()))
      step = dyn_cast<llvm::GetElementPtrInst>(step->getPointerOperand());
    if (!step)
      return;
    auto *choice = llvm::cast<llvm::Instruction>(step->getPointerOperand());
    for (llvm::Value *index : step->indices())
      if (auto *definition = dyn_cast<llvm::Instruction>(index))
        if (!dominance.properlyDominates(definition->getParent(),
                                         choice->getParent()))
          return;
    llvm::Instruction *made = choice->clone();
    made->insertBefore(choice->getIterator());
    unsigned begin = llvm::isa<llvm::SelectInst>(choice) ? 1 : 0;
    auto *phi = dyn_cast<llvm::PHINode>(made);
    std::map<llvm::BasicBlock *, llvm::Value *> parts;
    for (unsigned i = begin; i < made->getNumOperands(); ++i) {
      // A switch may come from one block several times.
      if (phi && parts.count(phi->getIncomingBlock(i))) {
        made->setOperand(i, parts[phi->getIncomingBlock(i)]);
        continue;
      }
      builder.SetInsertPoint(phi ? phi->getIncomingBlock(i)->getTerminator()
                                 : made);
      llvm::Instruction *clone = step->clone();
      clone->setOperand(0, made->getOperand(i));
      made->setOperand(i, builder.Insert(clone));
      if (phi)
        parts[phi->getIncomingBlock(i)] = clone;
    }
    step->replaceAllUsesWith(made);
    step->eraseFromParent();
    changed = true;
  }

  void collectAccesses(llvm::Value *choice, llvm::Value *pointer,
                       llvm::SmallVector<llvm::GetElementPtrInst *> steps,
                       llvm::SmallVectorImpl<Access> &accesses) {
    for (llvm::User *user : pointer->users()) {
      if (auto *step = dyn_cast<llvm::GetElementPtrInst>(user)) {
        auto further = steps;
        further.insert(further.begin(), step);
        collectAccesses(choice, step, further, accesses);
      } else if (auto *load = dyn_cast<llvm::LoadInst>(user)) {
        accesses.push_back({load, choice, steps});
      } else if (auto *store = dyn_cast<llvm::StoreInst>(user)) {
        if (store->getPointerOperand() == pointer)
          accesses.push_back({store, choice, steps});
      }
    }
  }

  /// Whether a pointer can be computed again at an instruction.
  bool isAvailable(llvm::Value *value, const Access &access) {
    auto *definition = dyn_cast<llvm::Instruction>(value);
    if (!definition || dominance.dominates(definition, access.instruction))
      return true;
    if (!value->getType()->isPointerTy())
      return isCarried(definition, access);
    if (llvm::isa<llvm::AllocaInst>(definition))
      return false;
    // Markers that give pointers have no effect, and a layout.
    if (!memory.getLayout(definition) &&
        !llvm::isa<llvm::GetElementPtrInst>(definition))
      return false;
    return llvm::all_of(definition->operands(), [&](llvm::Value *operand) {
      return isAvailable(operand, access);
    });
  }

  /// Whether a number that the target was computed from is still the latest of
  /// its kind at the access: whoever computes it anew must choose anew.
  bool isCarried(llvm::Instruction *number, const Access &access) {
    auto *choice = llvm::cast<llvm::Instruction>(access.choice);
    llvm::SmallPtrSet<llvm::BasicBlock *, 1> without = {choice->getParent()};
    return number->getParent() == choice->getParent() ||
           access.instruction->getParent() == choice->getParent() ||
           !llvm::isPotentiallyReachable(number->getParent(),
                                         access.instruction->getParent(),
                                         &without, &dominance);
  }

  llvm::Value *recompute(llvm::Value *value, llvm::Instruction *at) {
    auto *definition = dyn_cast<llvm::Instruction>(value);
    if (!definition || dominance.dominates(definition, at))
      return value;
    if (!value->getType()->isPointerTy()) {
      llvm::SSAUpdater updater;
      updater.Initialize(value->getType(), "");
      updater.AddAvailableValue(&function.getEntryBlock(),
                                llvm::PoisonValue::get(value->getType()));
      updater.AddAvailableValue(definition->getParent(), value);
      return updater.GetValueInMiddleOfBlock(at->getParent());
    }
    llvm::Instruction *clone = definition->clone();
    for (llvm::Use &operand : clone->operands())
      operand.set(recompute(operand.get(), at));
    return builder.Insert(clone);
  }

  std::map<llvm::Value *, llvm::Value *>
  makeTagValues(const llvm::SetVector<llvm::Value *> &choices,
                const llvm::SetVector<llvm::Value *> &targets) {
    std::map<llvm::Value *, llvm::Value *> tags;
    for (auto [number, target] : llvm::enumerate(targets))
      tags[target] = builder.getInt32(number);
    for (llvm::Value *choice : choices) {
      if (auto *phi = dyn_cast<llvm::PHINode>(choice)) {
        builder.SetInsertPoint(phi);
        tags[choice] = builder.CreatePHI(builder.getInt32Ty(),
                                         phi->getNumIncomingValues());
      } else {
        auto *select = llvm::cast<llvm::SelectInst>(choice);
        builder.SetInsertPoint(select);
        // Operands are filled in below: a select may come before its operands'
        // phis in this list.
        llvm::Value *zero = builder.getInt32(0);
        tags[choice] = builder.Insert(
            llvm::SelectInst::Create(select->getCondition(), zero, zero));
      }
    }
    for (llvm::Value *choice : choices) {
      if (auto *phi = dyn_cast<llvm::PHINode>(choice)) {
        auto *tag = llvm::cast<llvm::PHINode>(tags[choice]);
        for (unsigned i = 0; i < phi->getNumIncomingValues(); ++i)
          tag->addIncoming(tags[phi->getIncomingValue(i)],
                           phi->getIncomingBlock(i));
      } else {
        auto *select = llvm::cast<llvm::SelectInst>(choice);
        auto *tag = llvm::cast<llvm::SelectInst>(tags[choice]);
        tag->setTrueValue(tags[select->getTrueValue()]);
        tag->setFalseValue(tags[select->getFalseValue()]);
      }
    }
    return tags;
  }

  void rewrite(const Access &access, llvm::Value *tag,
               llvm::ArrayRef<llvm::Value *> targets) {
    llvm::Instruction *original = access.instruction;
    llvm::SmallVector<llvm::Value *> results;
    llvm::Instruction *at = original;
    llvm::SmallVector<std::pair<llvm::Instruction *, llvm::Instruction *>>
        forks;
    // A chain of tests; the last target needs none.
    for (size_t i = 0; i + 1 < targets.size(); ++i) {
      builder.SetInsertPoint(at);
      llvm::Value *test = builder.CreateICmpEQ(tag, builder.getInt32(i));
      llvm::Instruction *then, *other;
      llvm::SplitBlockAndInsertIfThenElse(test, at, &then, &other);
      dominance.recalculate(function);
      results.push_back(accessAt(access, targets[i], then));
      forks.push_back({then, at});
      at = other;
    }
    llvm::Value *last = accessAt(access, targets.back(), at);
    for (size_t i = forks.size(); i-- > 0 && last;) {
      llvm::Instruction *then = forks[i].first;
      llvm::BasicBlock *join = then->getSuccessor(0);
      builder.SetInsertPoint(join, join->begin());
      llvm::PHINode *phi = builder.CreatePHI(last->getType(), 2);
      phi->addIncoming(results[i], then->getParent());
      for (llvm::BasicBlock *from : llvm::predecessors(join))
        if (from != then->getParent())
          phi->addIncoming(last, from);
      last = phi;
    }
    if (last)
      original->replaceAllUsesWith(last);
    original->eraseFromParent();
    dominance.recalculate(function);
  }

  /// Repeats an access with a target in the place of the choice; null for a
  /// store.
  llvm::Value *accessAt(const Access &access, llvm::Value *target,
                        llvm::Instruction *at) {
    builder.SetInsertPoint(at);
    llvm::Value *pointer = recompute(target, at);
    for (llvm::GetElementPtrInst *step : llvm::reverse(access.steps)) {
      llvm::Instruction *clone = step->clone();
      clone->setOperand(0, pointer);
      pointer = builder.Insert(clone);
    }
    llvm::Instruction *clone = access.instruction->clone();
    bool isStore = llvm::isa<llvm::StoreInst>(clone);
    clone->setOperand(isStore ? 1 : 0, pointer);
    builder.Insert(clone);
    return isStore ? nullptr : clone;
  }

  llvm::Function &function;
  MemoryMap &memory;
  llvm::IRBuilder<> builder;
  llvm::DominatorTree dominance;
  bool changed = false;
};

} // namespace

bool piko::flattenPointers(llvm::Function &function, MemoryMap &memory) {
  return PointerFlattener(function, memory).run();
}
