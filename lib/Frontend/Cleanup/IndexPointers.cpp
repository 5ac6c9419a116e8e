//===- IndexPointers.cpp - Pointers that walk through memory --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Phis and selects of pointers that depend on each other in a circle, with
// address arithmetic on the way, become a root, which is where the walk begins,
// and an index, which is how far it has got:
//
//   first = phi [array], [next]          index = phi [0], [nextIndex]
//   middle = gep first, half        ->   nextIndex = select c, index + half +
//   1, beyond = gep middle, 1                                  index next =
//   select c, beyond, first       first = gep array, index
//
// Afterwards no pointer is computed from itself. A choice among elements of one
// array becomes the array and an index, too.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/PointerChoices.h"

#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/SetVector.h"
#include "llvm/IR/Dominators.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"

#include <numeric>

using namespace piko;
using llvm::dyn_cast;

namespace {

/// Tarjan's strongly connected components of choices, over what their operands
/// are computed from.
class ChoiceCircles {
public:
  ChoiceCircles(llvm::Function &function, const llvm::DataLayout &data)
      : data(data) {
    for (llvm::Instruction &instruction : llvm::instructions(function))
      if (isPointerChoice(&instruction) && !numbers.contains(&instruction))
        visit(&instruction);
  }

  using Circle = llvm::SmallSetVector<llvm::Instruction *, 4>;
  std::vector<Circle> circles;

private:
  unsigned visit(llvm::Instruction *choice) {
    unsigned number = numbers.size(), lowest = number;
    numbers[choice] = number;
    stack.push_back(choice);
    for (llvm::Value *operand : getChoiceOperands(choice)) {
      llvm::Value *base = getAddress(operand, data).base;
      if (!isPointerChoice(base))
        continue;
      auto *next = llvm::cast<llvm::Instruction>(base);
      if (!numbers.contains(next))
        lowest = std::min(lowest, visit(next));
      else if (llvm::is_contained(stack, next))
        lowest = std::min(lowest, numbers[next]);
    }
    if (lowest != number)
      return lowest;
    Circle circle;
    llvm::Instruction *last;
    do {
      last = stack.pop_back_val();
      circle.insert(last);
    } while (last != choice);
    circles.push_back(std::move(circle));
    return lowest;
  }

  const llvm::DataLayout &data;
  llvm::DenseMap<llvm::Instruction *, unsigned> numbers;
  llvm::SmallVector<llvm::Instruction *> stack;
};

/// One circle: each of its choices as a root and an index.
class PointerIndexer {
public:
  PointerIndexer(const ChoiceCircles::Circle &choices,
                 const llvm::DominatorTree &dominance, MemoryMap &memory)
      : choices(choices), dominance(dominance), memory(memory),
        data(memory.data), builder(choices.front()->getContext()) {}

  /// False if no pointer walks, and the choice is not among elements of one
  /// array.
  bool run() {
    collectOperands();
    if (unit != 0)
      findRoot();
    else if (!findArray())
      return false;
    llvm::MapVector<llvm::Instruction *, Position> positions;
    for (llvm::Instruction *choice : choices)
      positions[choice] = {root ? root : makeEmpty(choice, choice->getType()),
                           makeEmpty(choice, builder.getInt64Ty())};
    for (auto &[choice, position] : positions)
      for (unsigned i = getFirstOperand(choice); i < getEnd(choice); ++i)
        setOperand(choice, i, position, positions);
    for (auto &[choice, position] : positions)
      replace(choice, position);
    for (llvm::Instruction *choice : choices) {
      choice->replaceAllUsesWith(llvm::PoisonValue::get(choice->getType()));
      choice->eraseFromParent();
    }
    return true;
  }

private:
  struct Position {
    llvm::Value *root, *index;
  };

  static unsigned getFirstOperand(const llvm::Instruction *choice) {
    return llvm::isa<llvm::SelectInst>(choice) ? 1 : 0;
  }
  static unsigned getEnd(const llvm::Instruction *choice) {
    if (auto *phi = dyn_cast<llvm::PHINode>(choice))
      return phi->getNumIncomingValues();
    return choice->getNumOperands();
  }
  bool isInside(const Address &address) const {
    auto *base = dyn_cast<llvm::Instruction>(address.base);
    return base && choices.contains(base);
  }

  /// What the bytes from an offset to an address are a multiple of.
  static int64_t getDivisor(const Address &address, int64_t from) {
    int64_t divisor = std::abs(address.offset - from);
    for (auto [value, scale] : address.terms)
      divisor = std::gcd(divisor, std::abs(scale));
    return divisor;
  }

  void collectOperands() {
    for (llvm::Instruction *choice : choices)
      for (llvm::Value *operand : getChoiceOperands(choice)) {
        if (llvm::isa<llvm::UndefValue>(operand))
          continue;
        Address address = getAddress(operand, data);
        if (isInside(address)) {
          unit = std::gcd(unit, getDivisor(address, 0));
          continue;
        }
        if (llvm::is_contained(begins, operand))
          continue;
        begins.push_back(operand);
        addresses.push_back(address);
      }
    if (addresses.empty())
      return;
    // That of an element which is not indexed lies within the array.
    auto first = llvm::min_element(addresses, [](auto &left, auto &right) {
      return std::pair(!left.terms.empty(), left.offset) <
             std::pair(!right.terms.empty(), right.offset);
    });
    origin = first->offset;
  }

  /// Whether all begin within one member of one memory.
  bool haveOneBase() const {
    return !addresses.empty() &&
           llvm::all_of(addresses,
                        [&](const Address &address) {
                          return address.base == addresses.front().base &&
                                 address.member == addresses.front().member &&
                                 address.unclear == addresses.front().unclear;
                        }) &&
           dominatesAll(addresses.front().base);
  }

  /// The one value that the walk begins at, or begins so many units from.
  void findRoot() {
    if (begins.size() == 1) {
      if (dominatesAll(begins.front()))
        root = begins.front();
    } else if (haveOneBase() &&
               llvm::all_of(addresses,
                            [&](const Address &address) {
                              return getDivisor(address, origin) % unit == 0;
                            }) &&
               isArrayOfUnits()) {
      makeOrigin();
    }
  }

  /// Whether one index counts the units of the array that all begin in. That
  /// of an array in a record of an array does not lead to the next record's.
  bool isArrayOfUnits() {
    const MemoryLayout *layout = memory.getLayout(addresses.front().base);
    if (!layout)
      return false;
    int64_t member = addresses.front().member + addresses.front().unclear;
    bool isArray = false;
    for (const MemoryLeaf &leaf : layout->leaves) {
      if (!hasElementAt(leaf, member))
        continue;
      auto found = llvm::find_if(leaf.dimensions, [&](const auto &dimension) {
        return dimension.stride != 0 && unit % dimension.stride == 0;
      });
      if (found == leaf.dimensions.end())
        return false;
      for (auto outer = leaf.dimensions.begin(); outer != found; ++outer)
        if (outer->stride != outer[1].count * outer[1].stride)
          return false;
      isArray = true;
    }
    return isArray;
  }

  static bool hasElementAt(const MemoryLeaf &leaf, int64_t offset) {
    int64_t rest = offset - leaf.offset;
    for (auto [count, stride] : leaf.dimensions) {
      int64_t index = stride == 0 ? 0 : rest / stride;
      if (rest < 0 || index >= count)
        return false;
      rest -= index * stride;
    }
    return rest == 0;
  }

  /// The array that all are elements of. Steps among the fields of a record
  /// would lead to no array's element.
  bool findArray() {
    if (!haveOneBase())
      return false;
    for (const Address &address : addresses)
      unit = std::gcd(unit, getDivisor(address, origin));
    if (unit == 0 || !isArrayOfUnits())
      return false;
    makeOrigin();
    return true;
  }

  void makeOrigin() {
    llvm::Value *base = addresses.front().base;
    auto *definition = dyn_cast<llvm::Instruction>(base);
    if (definition)
      builder.SetInsertPoint(*definition->getInsertionPointAfterDef());
    else
      builder.SetInsertPoint(&*choices.front()
                                   ->getFunction()
                                   ->getEntryBlock()
                                   .getFirstInsertionPt());
    // Along the elements of the member, even where it begins before them.
    int64_t member = addresses.front().member + addresses.front().unclear;
    root = makeMemberAddress(builder, base, member);
    if (origin != member)
      root = builder.CreateConstGEP1_64(
          llvm::ArrayType::get(builder.getInt8Ty(), 1), root, origin - member);
    fromOrigin = true;
  }

  bool dominatesAll(llvm::Value *value) const {
    auto *definition = dyn_cast<llvm::Instruction>(value);
    return !definition || llvm::all_of(choices, [&](llvm::Instruction *choice) {
      return llvm::isa<llvm::PHINode>(choice)
                 ? dominance.dominates(definition, choice->getParent())
                 : dominance.dominates(definition, choice);
    });
  }

  llvm::Value *makeEmpty(llvm::Instruction *choice, llvm::Type *type) {
    builder.SetInsertPoint(choice);
    if (auto *phi = dyn_cast<llvm::PHINode>(choice))
      return builder.CreatePHI(type, phi->getNumIncomingValues());
    llvm::Value *unset = llvm::PoisonValue::get(type);
    return builder.Insert(
        llvm::SelectInst::Create(choice->getOperand(0), unset, unset));
  }

  static void setOperand(llvm::Instruction *choice, llvm::Value *made,
                         unsigned number, llvm::Value *value) {
    if (auto *phi = dyn_cast<llvm::PHINode>(choice))
      llvm::cast<llvm::PHINode>(made)->addIncoming(
          value, phi->getIncomingBlock(number));
    else
      llvm::cast<llvm::SelectInst>(made)->setOperand(number, value);
  }

  void setOperand(llvm::Instruction *choice, unsigned number,
                  const Position &position,
                  llvm::MapVector<llvm::Instruction *, Position> &positions) {
    Position from = getPosition(choice, number, positions);
    setOperand(choice, position.index, number, from.index);
    if (!root)
      setOperand(choice, position.root, number, from.root);
  }

  Position
  getPosition(llvm::Instruction *choice, unsigned number,
              llvm::MapVector<llvm::Instruction *, Position> &positions) {
    llvm::Value *operand = choice->getOperand(number);
    if (llvm::isa<llvm::UndefValue>(operand))
      return {operand, llvm::PoisonValue::get(builder.getInt64Ty())};
    Address address = getAddress(operand, data);
    Position position{operand, builder.getInt64(0)};
    if (isInside(address))
      position = positions[llvm::cast<llvm::Instruction>(address.base)];
    else if (!fromOrigin)
      return position;
    auto *phi = dyn_cast<llvm::PHINode>(choice);
    if (!phi) {
      builder.SetInsertPoint(
          llvm::cast<llvm::Instruction>(positions[choice].index));
    } else {
      // A switch may come from one block several times.
      unsigned first = phi->getBasicBlockIndex(phi->getIncomingBlock(number));
      if (first < number)
        return {root ? root : getIncoming(positions[choice].root, first),
                getIncoming(positions[choice].index, first)};
      builder.SetInsertPoint(phi->getIncomingBlock(number)->getTerminator());
    }
    int64_t from = isInside(address) ? 0 : origin;
    MemoryIndex steps{(address.offset - from) / unit, {}};
    for (auto [value, scale] : address.terms)
      steps.terms.push_back({value, scale / unit});
    if (!isInside(address))
      return {root, steps.materialize(builder)};
    if (steps.constant == 0 && steps.terms.empty())
      return position;
    return {position.root,
            builder.CreateAdd(position.index, steps.materialize(builder))};
  }
  static llvm::Value *getIncoming(llvm::Value *phi, unsigned number) {
    return llvm::cast<llvm::PHINode>(phi)->getIncomingValue(number);
  }

  void replace(llvm::Instruction *choice, const Position &position) {
    // What is computed from a null pointer is never looked at.
    for (llvm::Use &use : llvm::make_early_inc_range(choice->uses()))
      if (auto *test = dyn_cast<llvm::ICmpInst>(use.getUser()))
        if (llvm::isa<llvm::ConstantPointerNull>(test->getOperand(1)))
          use.set(position.root);
    builder.SetInsertPoint(choice);
    if (llvm::isa<llvm::PHINode>(choice))
      builder.SetInsertPoint(choice->getParent(),
                             choice->getParent()->getFirstInsertionPt());
    llvm::Value *pointer =
        builder.CreateGEP(llvm::ArrayType::get(builder.getInt8Ty(), unit),
                          position.root, position.index);
    choice->replaceUsesWithIf(pointer, [&](llvm::Use &use) {
      auto *user = dyn_cast<llvm::Instruction>(use.getUser());
      return !user || !choices.contains(user);
    });
  }

  const ChoiceCircles::Circle &choices;
  const llvm::DominatorTree &dominance;
  MemoryMap &memory;
  const llvm::DataLayout &data;
  llvm::IRBuilder<> builder;
  /// The operands that are computed from no choice of the circle.
  llvm::SmallVector<llvm::Value *> begins;
  llvm::SmallVector<Address> addresses;
  /// The least of their constant offsets, from which the index counts.
  int64_t origin = 0;
  /// What all steps are multiples of.
  int64_t unit = 0;
  /// Null if each choice needs its own.
  llvm::Value *root = nullptr;
  bool fromOrigin = false;
};

} // namespace

bool piko::indexPointers(llvm::Function &function, MemoryMap &memory) {
  llvm::DominatorTree dominance(function);
  ChoiceCircles found(function, memory.data);
  bool changed = false;
  for (const ChoiceCircles::Circle &circle : found.circles)
    changed |= PointerIndexer(circle, dominance, memory).run();
  return changed;
}
