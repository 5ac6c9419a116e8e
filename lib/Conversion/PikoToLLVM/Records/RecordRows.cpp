// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where records have an even number of words, pairs of words come first: half
// as many units take half as many permutations. Where all lanes are in the
// mask, as they mostly are, nothing has to find which words are those of which
// lane.

#include "PikoToLLVM/Records/RecordRows.h"

#include "PikoToLLVM/Records/RecordPieces.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

/// A shuffle of two vectors takes any word of both only with 512 bits.
bool piko::isRecordRow(int64_t laneCount, int64_t size, int64_t fields) {
  constexpr int64_t widest = 16, most = 8, mostOfOne = 4;
  int64_t words = size / wordSize;
  return laneCount == widest && size % wordSize == 0 && words > 1 &&
         words <= (fields > 1 ? most : mostOfOne);
}

RecordRow::RecordRow(OpBuilder &builder, Location loc, Value first,
                     int64_t size, Value mask, bool areMostlyAll)
    : builder(builder), loc(loc), first(first), mask(mask),
      areMostlyAll(areMostlyAll),
      lanes(llvm::cast<VectorType>(mask.getType()).getNumElements()),
      count(size / wordSize),
      type(VectorType::get({lanes}, builder.getI32Type())),
      pairs(VectorType::get({lanes / 2}, builder.getI64Type())) {}

Value RecordRow::shuffle(Value a, Value b, ArrayRef<int64_t> order) {
  return vector::ShuffleOp::create(builder, loc, a, b, order);
}

Value RecordRow::cast(Value vector, VectorType type) {
  return vector.getType() == type
             ? vector
             : vector::BitCastOp::create(builder, loc, type, vector)
                   .getResult();
}

Value RecordRow::createMask(int64_t vector) {
  SmallVector<int64_t> owners;
  for (int64_t i = 0; i < lanes; ++i)
    owners.push_back((vector * lanes + i) / count);
  return shuffle(mask, mask, owners);
}

Value RecordRow::getAddress(int64_t vector) {
  return createOffset(builder, loc, first, vector * lanes * wordSize);
}

Value RecordRow::deinterleave(ArrayRef<Value> vectors, int64_t unit) {
  int64_t count = vectors.size();
  if (count == 1)
    return vectors.front();
  int64_t width =
      llvm::cast<VectorType>(vectors.front().getType()).getNumElements();
  Value found = vectors.front();
  for (int64_t next = 1; next < count; ++next) {
    SmallVector<int64_t> order;
    for (int64_t i = 0; i < width; ++i) {
      int64_t place = i * count + unit, from = place / width;
      order.push_back(from == next  ? width + place % width
                      : from > next ? vector::ShuffleOp::kPoisonIndex
                      : next == 1   ? place % width
                                    : i);
    }
    found = shuffle(found, vectors[next], order);
  }
  return found;
}

Value RecordRow::createAreAll() {
  return vector::ReductionOp::create(builder, loc, vector::CombiningKind::AND,
                                     mask);
}

SmallVector<Value> RecordRow::load(bool areAll) {
  Value none =
      arith::ConstantOp::create(builder, loc, builder.getZeroAttr(type));
  SmallVector<Value> loaded;
  for (int64_t i = 0; i < count; ++i)
    if (areAll)
      loaded.push_back(
          LLVM::LoadOp::create(builder, loc, type, getAddress(i), wordSize));
    else
      loaded.push_back(LLVM::MaskedLoadOp::create(
          builder, loc, type, getAddress(i), createMask(i), none, wordSize));
  return loaded;
}

SmallVector<Value> RecordRow::load() {
  if (!areMostlyAll)
    return load(/*areAll=*/false);
  auto choice = scf::IfOp::create(builder, loc, SmallVector<Type>(count, type),
                                  createAreAll(), /*withElseRegion=*/true);
  OpBuilder::InsertionGuard guard(builder);
  for (Block *block : {choice.thenBlock(), choice.elseBlock()}) {
    builder.setInsertionPointToStart(block);
    scf::YieldOp::create(builder, loc, load(block == choice.thenBlock()));
  }
  return SmallVector<Value>(choice.getResults());
}

SmallVector<Value> RecordRow::read(ArrayRef<int64_t> words) {
  SmallVector<Value> loaded = load();
  SmallVector<Value> values;
  if (count % 2 != 0) {
    for (int64_t word : words)
      values.push_back(deinterleave(loaded, word));
    return values;
  }
  SmallVector<Value> halves[2];
  for (int64_t i = 0; i < count; ++i)
    halves[i / (count / 2)].push_back(cast(loaded[i], pairs));
  for (int64_t word : words) {
    SmallVector<int64_t> order;
    for (int64_t i = 0; i < lanes; ++i)
      order.push_back(2 * i + word % 2);
    values.push_back(shuffle(cast(deinterleave(halves[0], word / 2), type),
                             cast(deinterleave(halves[1], word / 2), type),
                             order));
  }
  return values;
}

Value RecordRow::interleave(ArrayRef<Value> units, int64_t number) {
  int64_t count = units.size(), first = -1;
  Value found;
  SmallVector<bool> isKnown(count);
  for (int64_t next = 0; next < count; ++next) {
    if (!units[next])
      continue;
    isKnown[next] = true;
    bool isAlone = llvm::count(isKnown, true) == 1;
    if (isAlone)
      first = next;
    bool isLast = llvm::none_of(units.drop_front(next + 1),
                                [](Value unit) { return bool(unit); });
    if (isAlone && !isLast)
      continue; // together with the second one
    bool isSecond = !found;
    int64_t width =
        llvm::cast<VectorType>(units[next].getType()).getNumElements();
    SmallVector<int64_t> order;
    for (int64_t i = 0; i < width; ++i) {
      int64_t place = number * width + i, unit = place % count;
      order.push_back(unit == next     ? width + place / count
                      : !isKnown[unit] ? vector::ShuffleOp::kPoisonIndex
                      : isSecond       ? place / count
                                       : i);
    }
    found = shuffle(found ? found : units[first], units[next], order);
  }
  return found;
}

SmallVector<Value> RecordRow::interleaveAll(ArrayRef<Value> words) {
  SmallVector<Value> vectors;
  if (count % 2 != 0) {
    for (int64_t i = 0; i < count; ++i)
      vectors.push_back(interleave(words, i));
    return vectors;
  }
  for (int64_t half = 0; half < 2; ++half) {
    SmallVector<Value> units;
    for (int64_t i = 0; i < count; i += 2) {
      Value pair = interleave(words.slice(i, 2), half);
      units.push_back(pair ? cast(pair, pairs) : Value());
    }
    for (int64_t i = 0; i < count / 2; ++i)
      vectors.push_back(cast(interleave(units, i), type));
  }
  return vectors;
}

void RecordRow::store(ArrayRef<Value> words, int64_t number, Value vector,
                      Value these) {
  SmallVector<bool> isWritten;
  for (int64_t word = 0; word < lanes; ++word)
    isWritten.push_back(bool(words[(number * lanes + word) % count]));
  if (llvm::is_contained(isWritten, false)) {
    Value written = arith::ConstantOp::create(
        builder, loc,
        DenseElementsAttr::get(llvm::cast<VectorType>(mask.getType()),
                               isWritten));
    these =
        these ? arith::AndIOp::create(builder, loc, these, written) : written;
  }
  if (these)
    LLVM::MaskedStoreOp::create(builder, loc, vector, getAddress(number), these,
                                wordSize);
  else
    LLVM::StoreOp::create(builder, loc, vector, getAddress(number), wordSize);
}

void RecordRow::write(ArrayRef<Value> words) {
  SmallVector<Value> vectors = interleaveAll(words);
  auto storeAll = [&](bool areAll) {
    for (int64_t i = 0; i < count; ++i)
      store(words, i, vectors[i], areAll ? Value() : createMask(i));
  };
  if (!areMostlyAll)
    return storeAll(/*areAll=*/false);
  auto choice = scf::IfOp::create(builder, loc, createAreAll(),
                                  /*withElseRegion=*/true);
  OpBuilder::InsertionGuard guard(builder);
  for (Block *block : {choice.thenBlock(), choice.elseBlock()}) {
    builder.setInsertionPointToStart(block);
    storeAll(block == choice.thenBlock());
  }
}
