//===- ExpandCopies.cpp - Copies and fills of a number that varies --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The standard library copies arrays by bytes, where there is a loop over
// elements in the user's mind. It becomes that loop again:
//
//   memmove(to, from, 8 * n)   ->   for k in 0 .. n: to[k] = from[k]
//
// or from the last element to the first one where `to` lies after `from`. An
// element is as long as a step along both arrays that divides the length.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"

#include "llvm/Analysis/ValueTracking.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/Operator.h"
#include "llvm/Support/KnownBits.h"
#include "llvm/Transforms/Utils/BasicBlockUtils.h"

#include <numeric>
#include <set>

using namespace piko;
using llvm::dyn_cast;

/// Elements of more numbers than this are not copied in a loop.
static constexpr int64_t pieceLimit = 64;

/// What a length is a multiple of.
static int64_t getDivisor(const llvm::Value *length,
                          const llvm::DataLayout &data, int depth = 0) {
  if (auto *number = dyn_cast<llvm::ConstantInt>(length))
    return std::abs(number->getSExtValue());
  // The number of zeros at the end of its bits.
  unsigned zeros = llvm::computeKnownBits(length, data).countMinTrailingZeros();
  int64_t power = int64_t(1) << std::min(zeros, 30u);
  auto *operation = dyn_cast<llvm::Operator>(length);
  if (!operation || depth == 4)
    return power;
  auto get = [&](unsigned number) {
    return getDivisor(operation->getOperand(number), data, depth + 1);
  };
  switch (operation->getOpcode()) {
  case llvm::Instruction::Mul:
    for (const llvm::Value *factor : operation->operands())
      if (auto *number = dyn_cast<llvm::ConstantInt>(factor))
        return std::lcm(power, std::abs(number->getSExtValue()));
    return power;
  case llvm::Instruction::Add:
  case llvm::Instruction::Sub:
    return std::lcm(power, std::gcd(get(0), get(1)));
  case llvm::Instruction::Select:
    return std::lcm(power, std::gcd(get(1), get(2)));
  default:
    return power;
  }
}

namespace {

/// One array of a copy.
struct Array {
  llvm::Value *pointer;
  Address address;
  const MemoryLayout *layout;

  /// Where it begins, as far as that is known.
  int64_t getBegin() const {
    return address.terms.empty() ? address.offset
                                 : address.member + address.unclear;
  }
  static int64_t getEnd(const MemoryLeaf &leaf, const llvm::DataLayout &data) {
    int64_t end = leaf.offset + data.getTypeStoreSize(leaf.type);
    for (auto [count, stride] : leaf.dimensions)
      end += (count - 1) * stride;
    return end;
  }
  static bool hasStride(const MemoryLeaf &leaf, int64_t stride) {
    return llvm::any_of(leaf.dimensions, [&](const MemoryDimension &dimension) {
      return dimension.stride == stride;
    });
  }
};

class CopyExpander {
public:
  CopyExpander(llvm::Function &function, const ParsedUnit &unit,
               MemoryMap &memory)
      : function(function), unit(unit), memory(memory), data(memory.data),
        builder(function.getContext()) {}

  bool run() {
    llvm::SmallVector<llvm::MemIntrinsic *> copies;
    for (llvm::Instruction &instruction : llvm::instructions(function))
      if (auto *copy = dyn_cast<llvm::MemIntrinsic>(&instruction))
        if (!llvm::isa<llvm::Constant>(copy->getLength()))
          copies.push_back(copy);
    bool changed = false;
    for (llvm::MemIntrinsic *copy : copies)
      changed |= expand(copy);
    return changed;
  }

private:
  bool expand(llvm::MemIntrinsic *copy) {
    llvm::SmallVector<Array, 2> arrays;
    llvm::SmallVector<llvm::Value *, 2> pointers = {copy->getRawDest()};
    auto *transfer = dyn_cast<llvm::MemTransferInst>(copy);
    if (transfer)
      pointers.push_back(transfer->getRawSource());
    for (llvm::Value *pointer : pointers) {
      Address address = getAddress(pointer, data);
      arrays.push_back({pointer, address, memory.getLayout(address.base)});
      if (!arrays.back().layout)
        return false;
    }
    int64_t divisor = getDivisor(copy->getLength(), data);
    std::set<int64_t> strides = getStrides(arrays.front());
    for (int64_t size : llvm::reverse(strides))
      if (divisor % size == 0)
        if (auto pieces = getElement(arrays, size, isOfElements(copy))) {
          makeLoop(copy, arrays, size, *pieces);
          return true;
        }
    return false;
  }

  std::set<int64_t> getStrides(const Array &array) const {
    std::set<int64_t> strides;
    for (const MemoryLeaf &leaf : array.layout->leaves)
      if (leaf.offset <= array.getBegin() &&
          array.getBegin() < Array::getEnd(leaf, data))
        for (auto [count, stride] : leaf.dimensions)
          if (stride != 0)
            strides.insert(stride);
    return strides;
  }

  /// Whether the standard library made it, of an array's elements: a user's own
  /// may go on after the array.
  bool isOfElements(const llvm::MemIntrinsic *copy) const {
    const llvm::DILocation *at = copy->getDebugLoc();
    return at && unit.programNames.lookup(at->getScope()->getSubprogram())
                     .starts_with("std::");
  }

  /// The numbers of an element, which are the same in all arrays.
  std::optional<llvm::SmallVector<MemoryPiece>>
  getElement(llvm::ArrayRef<Array> arrays, int64_t size, bool staysInside) {
    std::optional<llvm::SmallVector<MemoryPiece>> element;
    for (const Array &array : llvm::reverse(arrays)) {
      auto pieces = getPieces(*array.layout, array.address, size, pieceLimit);
      if (!pieces || pieces->empty() ||
          !consistsOf(array, *pieces, size, staysInside))
        return std::nullopt;
      auto isSame = [&](const auto &pair) {
        auto [left, right] = pair;
        return left.offset == right.offset &&
               data.getTypeStoreSize(left.type) ==
                   data.getTypeStoreSize(right.type);
      };
      if (element && (element->size() != pieces->size() ||
                      !llvm::all_of(llvm::zip(*element, *pieces), isSame)))
        return std::nullopt;
      element = pieces;
    }
    return element;
  }

  /// Whether the pieces come again at each step.
  bool consistsOf(const Array &array, llvm::ArrayRef<MemoryPiece> pieces,
                  int64_t size, bool staysInside) const {
    int64_t begin = array.getBegin();
    std::set<const MemoryLeaf *> leaves;
    for (const MemoryPiece &piece : pieces) {
      auto leaf =
          llvm::find_if(array.layout->leaves, [&](const MemoryLeaf &leaf) {
            int64_t at = begin + piece.offset;
            return leaf.type == piece.type && leaf.offset <= at &&
                   at < Array::getEnd(leaf, data) &&
                   Array::hasStride(leaf, size);
          });
      if (leaf == array.layout->leaves.end() || piece.type->isPointerTy())
        return false;
      leaves.insert(&*leaf);
    }
    return staysInside ||
           llvm::all_of(array.layout->leaves, [&](const MemoryLeaf &leaf) {
             return leaves.count(&leaf) || Array::getEnd(leaf, data) <= begin;
           });
  }

  /// Whether elements may be read after they have been written, from the first
  /// one to the last; null if that cannot be.
  llvm::Value *makeIsBackward(llvm::MemIntrinsic *copy,
                              llvm::ArrayRef<Array> arrays) {
    if (!llvm::isa<llvm::MemMoveInst>(copy))
      return nullptr;
    const Address &to = arrays[0].address, &from = arrays[1].address;
    // Of two elements of the state, only the same one matters.
    auto isElement = [&](const Address &address) {
      const Marker *marker = memory.getBaseMarker(address.base);
      return marker && marker->kind == MarkerKind::element;
    };
    if (to.base != from.base && !(isElement(to) && isElement(from)))
      return nullptr;
    return builder.CreateICmpSGT(makeOffset(to, builder),
                                 makeOffset(from, builder));
  }

  void makeLoop(llvm::MemIntrinsic *copy, llvm::ArrayRef<Array> arrays,
                int64_t size, llvm::ArrayRef<MemoryPiece> pieces) {
    builder.SetInsertPoint(copy);
    llvm::Value *length =
        builder.CreateZExtOrTrunc(copy->getLength(), builder.getInt64Ty());
    llvm::Value *count = builder.CreateSDiv(length, builder.getInt64(size), "",
                                            /*isExact=*/true);
    llvm::Value *isBackward = makeIsBackward(copy, arrays);
    llvm::Value *isAny = builder.CreateICmpSGT(count, builder.getInt64(0));
    llvm::Instruction *then =
        llvm::SplitBlockAndInsertIfThen(isAny, copy, /*Unreachable=*/false);
    auto [body, index] =
        llvm::SplitBlockAndInsertSimpleForLoop(count, then->getIterator());
    builder.SetInsertPoint(body);
    builder.SetCurrentDebugLocation(copy->getDebugLoc());
    llvm::Value *place = index;
    if (isBackward)
      place = builder.CreateSelect(
          isBackward,
          builder.CreateSub(builder.CreateSub(count, builder.getInt64(1)),
                            index),
          index);
    if (auto *fill = dyn_cast<llvm::MemSetInst>(copy))
      fillElement(fill, arrays[0], place, size, pieces);
    else
      copyElement(arrays, place, size, pieces);
    for (llvm::BasicBlock *block : {body->getParent(), then->getParent()})
      for (llvm::Instruction &instruction : *block)
        if (!instruction.getDebugLoc())
          instruction.setDebugLoc(copy->getDebugLoc());
    copy->eraseFromParent();
  }

  llvm::Value *getElementAddress(const Array &array, llvm::Value *place,
                                 int64_t size) {
    return builder.CreateGEP(llvm::ArrayType::get(builder.getInt8Ty(), size),
                             array.pointer, place);
  }

  void copyElement(llvm::ArrayRef<Array> arrays, llvm::Value *place,
                   int64_t size, llvm::ArrayRef<MemoryPiece> pieces) {
    llvm::Value *to = getElementAddress(arrays[0], place, size);
    llvm::Value *from = getElementAddress(arrays[1], place, size);
    llvm::SmallVector<llvm::Value *> values;
    for (const MemoryPiece &piece : pieces)
      values.push_back(builder.CreateLoad(
          piece.type, makeMemberAddress(builder, from, piece.offset)));
    for (auto [piece, value] : llvm::zip(pieces, values))
      builder.CreateStore(value, makeMemberAddress(builder, to, piece.offset));
  }

  void fillElement(llvm::MemSetInst *fill, const Array &array,
                   llvm::Value *place, int64_t size,
                   llvm::ArrayRef<MemoryPiece> pieces) {
    llvm::Value *to = getElementAddress(array, place, size);
    for (const MemoryPiece &piece : pieces)
      builder.CreateStore(
          repeatByte(builder, fill->getValue(), piece.type, data),
          makeMemberAddress(builder, to, piece.offset));
  }

  llvm::Function &function;
  const ParsedUnit &unit;
  MemoryMap &memory;
  const llvm::DataLayout &data;
  llvm::IRBuilder<> builder;
};

} // namespace

llvm::Value *piko::repeatByte(llvm::IRBuilderBase &builder, llvm::Value *byte,
                              llvm::Type *type, const llvm::DataLayout &data) {
  unsigned bits = data.getTypeSizeInBits(type);
  llvm::Value *value = builder.CreateMul(
      builder.CreateZExt(byte, builder.getIntNTy(bits)),
      builder.getInt(llvm::APInt::getSplat(bits, llvm::APInt(8, 1))));
  return builder.CreateBitCast(value, type);
}

bool piko::expandCopies(llvm::Function &function, const ParsedUnit &unit,
                        MemoryMap &memory) {
  return CopyExpander(function, unit, memory).run();
}
