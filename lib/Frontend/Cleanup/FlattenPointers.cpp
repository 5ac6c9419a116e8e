//===- FlattenPointers.cpp - Phis and selects of pointers -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A reference that may be to one of several things, such as std::max returns,
// becomes numbers: which kind of thing it is, on which each access branches,
// and what its address was computed from when it was chosen, such as the index
// of an element. Pointers into one array are compared and subtracted as
// offsets.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"

#include "Cleanup/PointerChoices.h"
#include "llvm/ADT/SetVector.h"
#include "llvm/IR/CFG.h"
#include "llvm/IR/Dominators.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/Transforms/Utils/BasicBlockUtils.h"
#include "llvm/Transforms/Utils/Local.h"

using namespace piko;
using llvm::dyn_cast;

/// A reference to one of more kinds of things than this is an error.
static constexpr size_t shapeLimit = 64;

namespace {

class PointerFlattener {
public:
  PointerFlattener(llvm::Function &function, MemoryMap &memory)
      : function(function), memory(memory), builder(function.getContext()) {}

  bool run() {
    changed = indexPointers(function, memory);
    dominance.recalculate(function);
    llvm::SmallVector<llvm::WeakVH> choices, comparisons;
    for (llvm::Instruction &instruction : llvm::instructions(function)) {
      if (isPointerChoice(&instruction))
        choices.push_back(&instruction);
      else if (llvm::isa<llvm::ICmpInst>(instruction) ||
               instruction.getOpcode() == llvm::Instruction::Sub)
        comparisons.push_back(&instruction);
    }
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
  /// A number for each choice.
  using Web = llvm::DenseMap<llvm::Value *, llvm::Value *>;

  //===--------------------------------------------------------------------===//
  // Pointers into one array
  //===--------------------------------------------------------------------===//

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
    llvm::Value *x = makeOffset(a, builder), *y = makeOffset(b, builder);
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
    /// Which of its operands is the place.
    unsigned operand;
    /// From the choice to the access, the last step first.
    llvm::SmallVector<llvm::GetElementPtrInst *> steps;
  };

  /// Targets that are computed in the same way from different numbers.
  struct Shape {
    llvm::Value *example;
    /// The numbers, each for each choice.
    llvm::SmallVector<Web> numbers;
  };

  /// Whether a number is the same whenever it is looked at.
  static bool isSettled(llvm::Value *number) {
    auto *definition = dyn_cast<llvm::Instruction>(number);
    return !definition || definition->getParent()->isEntryBlock();
  }

  /// All choices that lead to this one, and what they choose from.
  static void collectChoices(llvm::Value *first,
                             llvm::SetVector<llvm::Value *> &choices,
                             llvm::SetVector<llvm::Value *> &targets) {
    choices.insert(first);
    for (size_t i = 0; i < choices.size(); ++i)
      for (llvm::Value *operand : getChoiceOperands(choices[i]))
        if (!llvm::isa<llvm::UndefValue>(operand))
          (isPointerChoice(operand) ? choices : targets).insert(operand);
  }

  void makeTags(llvm::Instruction *first,
                llvm::SmallPtrSet<llvm::Value *, 8> &done) {
    llvm::SetVector<llvm::Value *> choices, targets;
    collectChoices(first, choices, targets);
    for (llvm::Value *target : targets) {
      Address address = getAddress(target, memory.data);
      if (!isPointerChoice(address.base))
        continue;
      // A member of one of several things: next time one of several members.
      distribute(target);
      return;
    }

    llvm::SmallVector<Access> accesses;
    llvm::SmallVector<llvm::ICmpInst *> tests;
    for (llvm::Value *choice : choices) {
      done.insert(choice);
      collectAccesses(choice, choice, {}, accesses);
      for (llvm::User *user : choice->users())
        if (auto *test = dyn_cast<llvm::ICmpInst>(user))
          if (test->isEquality() &&
              llvm::isa<llvm::ConstantPointerNull>(test->getOperand(1)))
            tests.push_back(test);
    }
    if ((accesses.empty() && tests.empty()) ||
        !llvm::all_of(
            targets, [&](llvm::Value *target) { return isComputable(target); }))
      return;

    llvm::SmallVector<Shape> shapes;
    std::map<llvm::Value *, unsigned> shapeOf;
    for (llvm::Value *target : targets) {
      unsigned number = 0;
      while (number < shapes.size() &&
             !isSameShape(target, shapes[number].example))
        ++number;
      if (number == shapes.size())
        shapes.push_back({target, {}});
      shapeOf[target] = number;
    }
    if (shapes.size() > shapeLimit)
      return;
    Web tags = makeWeb(choices, builder.getInt32Ty(), [&](llvm::Value *target) {
      return builder.getInt32(shapeOf[target]);
    });
    for (auto [number, shape] : llvm::enumerate(shapes))
      for (auto [i, first] : llvm::enumerate(getNumbers(shape.example))) {
        auto get = [&, number = number,
                    i = i](llvm::Value *target) -> llvm::Value * {
          return shapeOf[target] == number ? getNumbers(target)[i] : nullptr;
        };
        bool isCommon =
            isSettled(first) &&
            llvm::all_of(targets, [&, first = first](llvm::Value *target) {
              llvm::Value *other = get(target);
              return !other || other == first;
            });
        Web common;
        for (llvm::Value *choice : choices)
          common[choice] = first;
        shape.numbers.push_back(
            isCommon ? common : makeWeb(choices, first->getType(), get));
      }
    for (llvm::ICmpInst *test : tests)
      rewriteTest(test, tags[test->getOperand(0)], shapes);
    // Nobody reads through a null pointer.
    llvm::SmallVector<unsigned> things;
    for (auto [number, shape] : llvm::enumerate(shapes))
      if (!llvm::isa<llvm::ConstantPointerNull>(shape.example))
        things.push_back(number);
    if (!things.empty())
      for (const Access &access : accesses)
        rewrite(access, tags[access.choice], shapes, things);
    changed |= !tests.empty() || (!things.empty() && !accesses.empty());
  }

  /// gep (phi a, b) -> phi (gep a), (gep b), for the step nearest to the
  /// choice, and all choices that lead to it at once: one after the other would
  /// go round a loop for ever.
  void distribute(llvm::Value *target) {
    auto *step = dyn_cast<llvm::GetElementPtrInst>(target);
    while (step && !isPointerChoice(step->getPointerOperand()))
      step = dyn_cast<llvm::GetElementPtrInst>(step->getPointerOperand());
    if (!step)
      return;
    llvm::SetVector<llvm::Value *> choices, targets;
    collectChoices(step->getPointerOperand(), choices, targets);
    for (llvm::Value *index : step->indices())
      if (auto *definition = dyn_cast<llvm::Instruction>(index);
          definition && !getConstantIndex(index))
        for (llvm::Value *choice : choices)
          if (!dominance.properlyDominates(
                  definition->getParent(),
                  llvm::cast<llvm::Instruction>(choice)->getParent()))
            return;
    Web parts = makeWeb(choices, step->getType(), [&](llvm::Value *operand) {
      llvm::Instruction *clone = step->clone();
      clone->setOperand(0, operand);
      return builder.Insert(clone);
    });
    step->replaceAllUsesWith(parts[step->getPointerOperand()]);
    step->eraseFromParent();
    changed = true;
  }

  void collectAccesses(llvm::Value *choice, llvm::Value *pointer,
                       llvm::SmallVector<llvm::GetElementPtrInst *> steps,
                       llvm::SmallVectorImpl<Access> &accesses) {
    for (llvm::Use &use : pointer->uses()) {
      auto *user = llvm::cast<llvm::Instruction>(use.getUser());
      if (auto *step = dyn_cast<llvm::GetElementPtrInst>(user)) {
        auto further = steps;
        further.insert(further.begin(), step);
        collectAccesses(choice, step, further, accesses);
      } else if (isAccess(use) && !isKnown(user, accesses)) {
        accesses.push_back({user, choice, use.getOperandNo(), steps});
      }
    }
  }

  /// A copy has two places: next time the other one.
  static bool isKnown(const llvm::Instruction *instruction,
                      llvm::ArrayRef<Access> accesses) {
    return llvm::any_of(accesses, [&](const Access &access) {
      return access.instruction == instruction;
    });
  }

  /// Whether an instruction reads or writes at a place.
  bool isAccess(const llvm::Use &place) const {
    auto *user = place.getUser();
    if (llvm::isa<llvm::LoadInst, llvm::MemTransferInst>(user))
      return true;
    if (auto *store = dyn_cast<llvm::StoreInst>(user))
      return place.getOperandNo() == store->getPointerOperandIndex();
    auto *call = dyn_cast<llvm::CallInst>(user);
    const Marker *marker = call ? getMarker(call, memory.markers) : nullptr;
    return marker && (marker->kind == MarkerKind::atomic ||
                      marker->kind == MarkerKind::atomicFetch);
  }

  //===--------------------------------------------------------------------===//
  // What addresses are computed from
  //===--------------------------------------------------------------------===//

  static bool isBase(const llvm::Value *pointer) {
    return !llvm::isa<llvm::Instruction>(pointer) ||
           llvm::isa<llvm::AllocaInst>(pointer);
  }

  /// The operands that an address depends on.
  static llvm::iterator_range<llvm::User::op_iterator>
  getInputs(llvm::Instruction *definition) {
    if (auto *call = dyn_cast<llvm::CallBase>(definition))
      return {call->arg_begin(), call->arg_end()};
    return definition->operands();
  }
  /// Whether an input is the same number for all targets of one shape.
  static bool isFixed(const llvm::Instruction *definition,
                      const llvm::Value *input) {
    return llvm::isa<llvm::GetElementPtrInst>(definition) &&
           (llvm::isa<llvm::Constant>(input) || getConstantIndex(input));
  }

  /// Whether a pointer can be computed again, given its numbers.
  bool isComputable(llvm::Value *pointer) {
    if (isBase(pointer))
      return true;
    auto *definition = llvm::cast<llvm::Instruction>(pointer);
    // Markers that give pointers have no effect, and a layout.
    if (!memory.getLayout(definition) &&
        !llvm::isa<llvm::GetElementPtrInst>(definition))
      return false;
    return llvm::all_of(getInputs(definition), [&](llvm::Value *input) {
      return !input->getType()->isPointerTy() || isComputable(input);
    });
  }

  static bool isSameShape(llvm::Value *left, llvm::Value *right) {
    if (left == right)
      return true;
    if (isBase(left) || isBase(right))
      return false;
    auto *a = llvm::cast<llvm::Instruction>(left);
    auto *b = llvm::cast<llvm::Instruction>(right);
    if (!a->isSameOperationAs(b) ||
        (llvm::isa<llvm::CallBase>(a) &&
         llvm::cast<llvm::CallBase>(a)->getCalledOperand() !=
             llvm::cast<llvm::CallBase>(b)->getCalledOperand()))
      return false;
    for (auto [x, y] : llvm::zip(getInputs(a), getInputs(b))) {
      if (x->getType() != y->getType())
        return false;
      if (x->getType()->isPointerTy()      ? !isSameShape(x, y)
          : isFixed(a, x) || isFixed(b, y) ? x != y
                                           : false)
        return false;
    }
    return true;
  }

  static void collectNumbers(llvm::Value *pointer,
                             llvm::SmallVectorImpl<llvm::Value *> &numbers) {
    if (isBase(pointer))
      return;
    auto *definition = llvm::cast<llvm::Instruction>(pointer);
    for (llvm::Value *input : getInputs(definition))
      if (input->getType()->isPointerTy())
        collectNumbers(input, numbers);
      else if (!isFixed(definition, input))
        numbers.push_back(input);
  }
  static llvm::SmallVector<llvm::Value *> getNumbers(llvm::Value *pointer) {
    llvm::SmallVector<llvm::Value *> numbers;
    collectNumbers(pointer, numbers);
    return numbers;
  }

  /// Computes a pointer again, from numbers in the order of getNumbers.
  llvm::Value *recompute(llvm::Value *pointer,
                         llvm::ArrayRef<llvm::Value *> &numbers) {
    if (isBase(pointer))
      return pointer;
    auto *definition = llvm::cast<llvm::Instruction>(pointer);
    llvm::Instruction *clone = definition->clone();
    for (llvm::Use &input : getInputs(clone)) {
      if (input->getType()->isPointerTy()) {
        input.set(recompute(input.get(), numbers));
      } else if (!isFixed(definition, input.get())) {
        input.set(numbers.front());
        numbers = numbers.drop_front();
      }
    }
    return builder.Insert(clone);
  }

  /// A value for each choice, chosen as the choice is: what `get` says of a
  /// target, or any value where it says nothing. The builder is where the
  /// choice needs it.
  Web makeWeb(const llvm::SetVector<llvm::Value *> &choices, llvm::Type *type,
              llvm::function_ref<llvm::Value *(llvm::Value *)> get) {
    Web web;
    llvm::Value *unset = llvm::PoisonValue::get(type);
    for (llvm::Value *choice : choices) {
      auto *instruction = llvm::cast<llvm::Instruction>(choice);
      builder.SetInsertPoint(instruction);
      if (auto *phi = dyn_cast<llvm::PHINode>(choice))
        web[choice] = builder.CreatePHI(type, phi->getNumIncomingValues());
      else
        web[choice] = builder.Insert(
            llvm::SelectInst::Create(instruction->getOperand(0), unset, unset));
    }
    auto find = [&](llvm::Value *operand) -> llvm::Value * {
      if (isPointerChoice(operand))
        return web[operand];
      llvm::Value *value =
          llvm::isa<llvm::UndefValue>(operand) ? nullptr : get(operand);
      return value ? value : unset;
    };
    for (llvm::Value *choice : choices) {
      if (auto *phi = dyn_cast<llvm::PHINode>(choice)) {
        auto *made = llvm::cast<llvm::PHINode>(web[choice]);
        for (unsigned i = 0; i < phi->getNumIncomingValues(); ++i) {
          llvm::BasicBlock *from = phi->getIncomingBlock(i);
          builder.SetInsertPoint(from->getTerminator());
          // A switch may come from one block several times.
          int known = made->getBasicBlockIndex(from);
          made->addIncoming(known < 0 ? find(phi->getIncomingValue(i))
                                      : made->getIncomingValue(known),
                            from);
        }
      } else {
        auto *select = llvm::cast<llvm::SelectInst>(choice);
        auto *made = llvm::cast<llvm::SelectInst>(web[choice]);
        builder.SetInsertPoint(made);
        made->setTrueValue(find(select->getTrueValue()));
        made->setFalseValue(find(select->getFalseValue()));
      }
    }
    return web;
  }

  //===--------------------------------------------------------------------===//
  // Accesses
  //===--------------------------------------------------------------------===//

  /// Whether a reference is to nothing.
  void rewriteTest(llvm::ICmpInst *test, llvm::Value *tag,
                   llvm::ArrayRef<Shape> shapes) {
    builder.SetInsertPoint(test);
    llvm::Value *isNull = builder.getFalse();
    for (auto [number, shape] : llvm::enumerate(shapes))
      if (llvm::isa<llvm::ConstantPointerNull>(shape.example))
        isNull = builder.CreateICmpEQ(tag, builder.getInt32(number));
    test->replaceAllUsesWith(test->getPredicate() == llvm::ICmpInst::ICMP_EQ
                                 ? isNull
                                 : builder.CreateNot(isNull));
    test->eraseFromParent();
  }

  /// Branches on the tag, one way for each of the shapes that are things.
  void rewrite(const Access &access, llvm::Value *tag,
               llvm::ArrayRef<Shape> shapes, llvm::ArrayRef<unsigned> things) {
    llvm::Instruction *original = access.instruction;
    llvm::SmallVector<llvm::Value *> results;
    llvm::Instruction *at = original;
    llvm::SmallVector<std::pair<llvm::Instruction *, llvm::Instruction *>>
        forks;
    // A chain of tests; the last one needs none.
    for (unsigned thing : things.drop_back()) {
      builder.SetInsertPoint(at);
      llvm::Value *test = builder.CreateICmpEQ(tag, builder.getInt32(thing));
      llvm::Instruction *then, *other;
      llvm::SplitBlockAndInsertIfThenElse(test, at, &then, &other);
      dominance.recalculate(function);
      results.push_back(accessAt(access, shapes[thing], then));
      forks.push_back({then, at});
      at = other;
    }
    llvm::Value *last = accessAt(access, shapes[things.back()], at);
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

  /// Repeats an access with a thing in the place of the choice; null if it
  /// gives nothing.
  llvm::Value *accessAt(const Access &access, const Shape &shape,
                        llvm::Instruction *at) {
    builder.SetInsertPoint(at);
    llvm::SmallVector<llvm::Value *> values;
    for (const Web &web : shape.numbers)
      values.push_back(web.lookup(access.choice));
    llvm::ArrayRef<llvm::Value *> numbers = values;
    llvm::Value *pointer = recompute(shape.example, numbers);
    for (llvm::GetElementPtrInst *step : llvm::reverse(access.steps)) {
      llvm::Instruction *clone = step->clone();
      clone->setOperand(0, pointer);
      pointer = builder.Insert(clone);
    }
    llvm::Instruction *clone = access.instruction->clone();
    clone->setOperand(access.operand, pointer);
    builder.Insert(clone);
    return clone->getType()->isVoidTy() ? nullptr : clone;
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
