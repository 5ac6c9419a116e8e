// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/TransposeGathers.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/ADT/Sequence.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/Operator.h"
#include "llvm/IR/PatternMatch.h"

#include <array>
#include <map>

using namespace llvm;
using namespace llvm::PatternMatch;

static constexpr int64_t wordSize = 4, pieceWords = 4;
static constexpr unsigned pointerBits = 64;

namespace {

/// Where lanes load: what they have in common but for a constant.
struct WordPlace {
  const Value *root = nullptr;
  SmallVector<std::pair<const Value *, APInt>, 2> terms; ///< with their factors
  int64_t offset = 0;                                    ///< in bytes

  void add(const Value *term, APInt factor);
  bool isApartFrom(const WordPlace &other) const {
    return root == other.root && terms.size() == other.terms.size() &&
           all_of(terms,
                  [&](const auto &t) { return is_contained(other.terms, t); });
  }
};

/// Gathers between which nothing is written, by their distance from the first
/// one. Of several of one word, each is here.
struct Group {
  WordPlace place; ///< of the first
  IntrinsicInst *first;
  std::map<int64_t, SmallVector<IntrinsicInst *, 1>> words;
};

/// Writes what stands for a group of gathers.
class TransposeWriter {
public:
  explicit TransposeWriter(const Group &group)
      : group(group), type(cast<FixedVectorType>(group.first->getType())),
        lanes(type->getNumElements()) {}
  /// Whether words `begin` and the three after it take fewer cycles so.
  bool paysAt(int64_t begin) const;
  void write(int64_t begin);
  bool isDone(int64_t word) const { return done.count(word) != 0; }

private:
  /// What each lane has at one place, as four words.
  SmallVector<Value *> load(IRBuilder<> &builder, int64_t begin);
  Value *join(IRBuilder<> &builder, ArrayRef<Value *> parts);

  const Group &group;
  FixedVectorType *type;
  unsigned lanes;
  SmallVector<Value *> pointers; ///< of each lane's first word
  std::map<int64_t, Value *> done;
};

} // namespace

/// A sum with a constant is two terms: addresses are numbers modulo 2^64.
void WordPlace::add(const Value *term, APInt factor) {
  const APInt *constant;
  const Value *rest;
  while (match(term, m_Add(m_Value(rest), m_APInt(constant))) &&
         constant->getBitWidth() == pointerBits) {
    offset += (*constant * factor).getSExtValue();
    term = rest;
  }
  if (match(term, m_APInt(constant)))
    offset += (constant->sextOrTrunc(pointerBits) * factor).getSExtValue();
  else if (auto *known =
               find_if(terms, [&](auto &t) { return t.first == term; });
           known != terms.end())
    known->second += factor;
  else
    terms.emplace_back(term, factor);
}

static WordPlace findPlace(const IntrinsicInst *gather) {
  const DataLayout &layout = gather->getDataLayout();
  WordPlace place;
  place.root = gather->getArgOperand(0);
  while (auto *address = dyn_cast<GEPOperator>(place.root)) {
    SmallMapVector<Value *, APInt, 4> variables;
    APInt constant(pointerBits, 0);
    if (!address->collectOffset(layout, pointerBits, variables, constant))
      break;
    place.offset += constant.getSExtValue();
    for (auto &[term, factor] : variables)
      place.add(term, factor);
    place.root = address->getPointerOperand();
  }
  return place;
}

/// Whether all lanes load a word of 32 bits.
static bool isOfAllWords(const IntrinsicInst *gather) {
  auto *type = dyn_cast<FixedVectorType>(gather->getType());
  return gather->getIntrinsicID() == Intrinsic::masked_gather && type &&
         type->getScalarSizeInBits() == 32 &&
         (type->getNumElements() == 8 || type->getNumElements() == 16) &&
         match(gather->getArgOperand(1), m_AllOnes());
}

static void addGather(IntrinsicInst *gather, SmallVectorImpl<Group> &groups,
                      size_t firstOpen) {
  WordPlace place = findPlace(gather);
  for (Group &group : drop_begin(groups, firstOpen)) {
    int64_t distance = place.offset - group.place.offset;
    if (distance % wordSize == 0 && place.isApartFrom(group.place) &&
        cast<FixedVectorType>(group.first->getType())->getElementCount() ==
            cast<FixedVectorType>(gather->getType())->getElementCount()) {
      group.words[distance].push_back(gather);
      return;
    }
  }
  groups.push_back({std::move(place), gather, {}});
  groups.back().words[0].push_back(gather);
}

static SmallVector<Group> findGroups(BasicBlock &block) {
  SmallVector<Group> groups;
  size_t firstOpen = 0;
  for (Instruction &instruction : block) {
    auto *call = dyn_cast<IntrinsicInst>(&instruction);
    if (call && isOfAllWords(call))
      addGather(call, groups, firstOpen);
    else if (instruction.mayWriteToMemory())
      firstOpen = groups.size();
  }
  return groups;
}

/// A piece takes two shuffles for each word of eight lanes, and what joins the
/// loads; lanes load the first and the last of its words, and so all four.
bool TransposeWriter::paysAt(int64_t begin) const {
  constexpr int64_t last = (pieceWords - 1) * wordSize;
  if (!group.words.count(begin) || !group.words.count(begin + last))
    return false;
  int64_t fresh = 0;
  for (int64_t word = begin; word <= begin + last; word += wordSize)
    fresh += group.words.count(word) && !isDone(word);
  return fresh >= (lanes > 8 ? 2 : 3);
}

SmallVector<Value *> TransposeWriter::load(IRBuilder<> &builder,
                                           int64_t begin) {
  if (pointers.empty()) {
    IRBuilder<> first(group.first);
    for (unsigned lane = 0; lane < lanes; ++lane)
      pointers.push_back(first.CreateExtractElement(
          group.first->getArgOperand(0), uint64_t(lane)));
  }
  AAMDNodes access;
  bool isFirst = true;
  for (int64_t word = begin; word < begin + pieceWords * wordSize;
       word += wordSize)
    if (auto found = group.words.find(word); found != group.words.end())
      for (IntrinsicInst *gather : found->second) {
        AAMDNodes own = gather->getAAMetadata();
        access = std::exchange(isFirst, false) ? own : access.merge(own);
      }
  auto *piece = FixedVectorType::get(builder.getInt32Ty(), pieceWords);
  SmallVector<Value *> parts;
  for (Value *pointer : pointers) {
    LoadInst *part = builder.CreateAlignedLoad(
        piece, builder.CreatePtrAdd(pointer, builder.getInt64(begin)),
        Align(wordSize));
    part->setAAMetadata(access);
    parts.push_back(part);
  }
  return parts;
}

Value *TransposeWriter::join(IRBuilder<> &builder, ArrayRef<Value *> parts) {
  if (parts.size() == 1)
    return parts.front();
  Value *a = join(builder, parts.take_front(parts.size() / 2)),
        *b = join(builder, parts.drop_front(parts.size() / 2));
  return builder.CreateShuffleVector(
      a, b, to_vector(seq<int>(0, int(parts.size() * pieceWords))));
}

/// The blocks of 4 x 4 words that four vectors are made of, transposed.
static std::array<Value *, pieceWords>
transpose(IRBuilder<> &builder, const std::array<Value *, pieceWords> &rows) {
  int lanes = cast<FixedVectorType>(rows[0]->getType())->getNumElements();
  auto mix = [&](Value *a, Value *b, std::array<int, pieceWords> block) {
    SmallVector<int> order;
    for (int group = 0; group < lanes; group += pieceWords)
      for (int word : block)
        order.push_back(word < pieceWords ? group + word
                                          : lanes + group + word - pieceWords);
    return builder.CreateShuffleVector(a, b, order);
  };
  Value *low01 = mix(rows[0], rows[1], {0, 4, 1, 5}),
        *high01 = mix(rows[0], rows[1], {2, 6, 3, 7}),
        *low23 = mix(rows[2], rows[3], {0, 4, 1, 5}),
        *high23 = mix(rows[2], rows[3], {2, 6, 3, 7});
  return {mix(low01, low23, {0, 1, 4, 5}), mix(low01, low23, {2, 3, 6, 7}),
          mix(high01, high23, {0, 1, 4, 5}), mix(high01, high23, {2, 3, 6, 7})};
}

void TransposeWriter::write(int64_t begin) {
  IntrinsicInst *earliest = nullptr;
  for (int64_t i = 0; i < pieceWords; ++i)
    if (auto found = group.words.find(begin + i * wordSize);
        found != group.words.end() && !isDone(found->first))
      for (IntrinsicInst *gather : found->second)
        if (!earliest || gather->comesBefore(earliest))
          earliest = gather;
  IRBuilder<> builder(earliest);
  SmallVector<Value *> parts = load(builder, begin);
  std::array<Value *, pieceWords> rows;
  for (unsigned i = 0; i < pieceWords; ++i) {
    SmallVector<Value *> row;
    for (unsigned lane = i; lane < lanes; lane += pieceWords)
      row.push_back(parts[lane]);
    rows[i] = join(builder, row);
  }
  rows = transpose(builder, rows);
  for (auto [i, row] : enumerate(rows)) {
    int64_t word = begin + int64_t(i) * wordSize;
    auto found = group.words.find(word);
    if (found == group.words.end() || !done.emplace(word, row).second)
      continue;
    for (IntrinsicInst *gather : found->second)
      gather->replaceAllUsesWith(builder.CreateBitCast(row, gather->getType()));
  }
}

/// Whether it has changed anything.
static bool transposeGroup(const Group &group) {
  constexpr int64_t last = (pieceWords - 1) * wordSize;
  TransposeWriter writer(group);
  for (const auto &[word, gathers] : group.words) {
    if (writer.isDone(word))
      continue;
    // From this word on, or up to the last one that is near.
    auto next = group.words.upper_bound(word + last);
    int64_t begin = std::prev(next)->first - last;
    if (writer.paysAt(word))
      writer.write(word);
    else if (writer.paysAt(begin))
      writer.write(begin);
  }
  bool isChanged = false;
  for (const auto &[word, gathers] : group.words)
    if (writer.isDone(word))
      for (IntrinsicInst *gather : gathers) {
        gather->eraseFromParent();
        isChanged = true;
      }
  return isChanged;
}

bool piko::TransposeGathersPass::change(Function &function,
                                        FunctionAnalysisManager &) {
  bool isChanged = false;
  for (BasicBlock &block : function)
    for (const Group &group : findGroups(block))
      isChanged |= transposeGroup(group);
  return isChanged;
}
