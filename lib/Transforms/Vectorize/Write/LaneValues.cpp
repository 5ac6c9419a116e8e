// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Vectorize/Write/LaneValues.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/TypeUtilities.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Vectors and masks
//===----------------------------------------------------------------------===//

Value LaneValues::splat(Value scalar) {
  if (isa<PrimType>(scalar.getType()))
    scalar = ToAddressOp::create(builder, loc, scalar);
  return vector::BroadcastOp::create(builder, loc,
                                     getVectorType(scalar.getType()), scalar);
}

Value LaneValues::zeros(Type type) {
  return arith::ConstantOp::create(builder, loc, builder.getZeroAttr(type));
}

Value LaneValues::invert(Value mask) {
  Value yes = arith::ConstantOp::create(
      builder, loc,
      DenseElementsAttr::get(cast<ShapedType>(mask.getType()), true));
  return arith::XOrIOp::create(builder, loc, mask, yes);
}

Value LaneValues::choose(Value mask, Value yes, Value no) {
  return yes == no ? yes : arith::SelectOp::create(builder, loc, mask, yes, no);
}

Value LaneValues::both(Value mask, Value other) {
  return choose(mask, other, zeros(mask.getType()));
}

Value LaneValues::any(Value mask) {
  return vector::ReductionOp::create(builder, loc, vector::CombiningKind::OR,
                                     mask);
}

Value LaneValues::createMask(llvm::function_ref<bool(int64_t)> holds) {
  SmallVector<bool> lanes;
  for (int64_t lane = 0; lane < laneCount; ++lane)
    lanes.push_back(holds(lane));
  return arith::ConstantOp::create(
      builder, loc,
      DenseElementsAttr::get(getVectorType(builder.getI1Type()), lanes));
}

Value LaneValues::getFirstLanes(Value count) {
  SmallVector<int32_t> steps =
      llvm::to_vector(llvm::seq<int32_t>(0, laneCount));
  Value step = arith::ConstantOp::create(
      builder, loc,
      DenseIntElementsAttr::get(getVectorType(builder.getI32Type()), steps));
  return arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt, step,
                               splat(count));
}

Value LaneValues::number(int64_t value) {
  return arith::ConstantOp::create(
      builder, loc,
      DenseElementsAttr::get(getVectorType(builder.getI32Type()),
                             builder.getI32IntegerAttr(value)));
}

Value LaneValues::permute(Value value, Value from) {
  return PermuteOp::create(builder, loc, value, from);
}

SmallVector<Value> LaneValues::shuffle(ValueRange values,
                                       ArrayRef<int64_t> from) {
  return llvm::map_to_vector(values, [&](Value value) -> Value {
    return vector::ShuffleOp::create(builder, loc, value, value, from);
  });
}

//===----------------------------------------------------------------------===//
// What lanes have of a value
//===----------------------------------------------------------------------===//

Value LaneValues::get(Value value) {
  if (Value known = vectors.lookupOrNull(value))
    return known;
  assert(!lanes.isVarying(value) && "expected what varies to be computed");
  return splat(getUniform(value));
}

Type LaneValues::getCarriedType(Value value) const {
  return lanes.isVarying(value) ? Type(getVectorType(value.getType()))
                                : value.getType();
}

void LaneValues::setCarried(Value value, Value carried) {
  (lanes.isVarying(value) ? vectors : scalars).map(value, carried);
}

Value LaneValues::getFirst(Value value) {
  if (!lanes.isVarying(value))
    return getUniform(value);
  if (Value known = firsts.lookupOrNull(value))
    return known;
  Operation *op = value.getDefiningOp();
  IRMapping operands;
  for (Value operand : op->getOperands())
    operands.map(operand, getFirst(operand));
  // Not kept: it stands where it is needed.
  return builder.clone(*op, operands)->getResult(0);
}

SmallVector<Value> LaneValues::getAll(ValueRange values) {
  return llvm::map_to_vector(values, [&](Value value) { return get(value); });
}

Operation *LaneValues::createVector(Operation *op, ValueRange operands) {
  OperationState state(loc, op->getName());
  state.addOperands(operands);
  for (Type type : op->getResultTypes())
    state.addTypes(getVectorType(type));
  state.propertiesAttr = op->getPropertiesAsAttribute();
  return builder.create(state);
}

Type LaneValues::getWord() {
  constexpr int64_t byteSize = 8;
  return builder.getIntegerType(std::max(laneCount, byteSize));
}

Value LaneValues::getBits(Value mask) {
  Type bits = builder.getIntegerType(laneCount), word = getWord();
  Value packed = vector::ExtractOp::create(
      builder, loc,
      vector::BitCastOp::create(builder, loc, VectorType::get({1}, bits), mask),
      ArrayRef<int64_t>{0});
  return bits == word ? packed
                      : arith::ExtUIOp::create(builder, loc, word, packed);
}

Value LaneValues::getMask(Value word) {
  Type bits = builder.getIntegerType(laneCount);
  if (word.getType() != bits)
    word = arith::TruncIOp::create(builder, loc, bits, word);
  Value packed = vector::BroadcastOp::create(builder, loc,
                                             VectorType::get({1}, bits), word);
  return vector::BitCastOp::create(builder, loc,
                                   getVectorType(builder.getI1Type()), packed);
}

//===----------------------------------------------------------------------===//
// Slots
//===----------------------------------------------------------------------===//

/// As what memory holds a value of lanes.
static Type getSlotType(Type type) {
  if (type.isInteger(1))
    return IntegerType::get(type.getContext(), 8);
  return isa<PrimType>(type) ? IndexType::get(type.getContext()) : type;
}

Value LaneValues::createSlot(Type type) {
  OpBuilder arrays(outermost);
  return memref::AllocaOp::create(
      arrays, loc, MemRefType::get({laneCount}, getSlotType(type)),
      arrays.getI64IntegerAttr(lineSize));
}

/// A number, or numbers, as a slot holds them.
static Value toSlot(OpBuilder &builder, Location loc, Value value, Type kept) {
  Type type = value.getType();
  if (isa<PrimType>(type))
    return ToAddressOp::create(builder, loc, value);
  if (getElementTypeOrSelf(type) == kept)
    return value;
  auto vector = dyn_cast<VectorType>(type);
  return arith::ExtUIOp::create(
      builder, loc, vector ? Type(vector.clone(kept)) : kept, value);
}

static Value fromSlot(OpBuilder &builder, Location loc, Value value,
                      Type type) {
  if (auto prim = dyn_cast<PrimType>(type))
    return FromAddressOp::create(builder, loc, prim, value);
  if (value.getType() == type)
    return value;
  Value zero = arith::ConstantOp::create(builder, loc,
                                         builder.getZeroAttr(value.getType()));
  return arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne, value,
                               zero);
}

static Type getKept(Value slot) {
  return cast<MemRefType>(slot.getType()).getElementType();
}

void LaneValues::storeSlot(Value value, Value slot, Value at) {
  value = toSlot(builder, loc, value, getKept(slot));
  if (isa<VectorType>(value.getType()))
    vector::StoreOp::create(builder, loc, value, slot, at);
  else
    memref::StoreOp::create(builder, loc, value, slot, at);
}

Value LaneValues::loadSlot(Value slot, Value at, Type type) {
  Value value =
      isa<VectorType>(type)
          ? vector::LoadOp::create(builder, loc, getVectorType(getKept(slot)),
                                   slot, at)
                .getResult()
          : memref::LoadOp::create(builder, loc, slot, at).getResult();
  return fromSlot(builder, loc, value, type);
}
