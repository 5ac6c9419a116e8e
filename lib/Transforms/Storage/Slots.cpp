// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Transforms/Storage/Slots.h"
#include "Piko/Analysis/TargetModel.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"

using namespace mlir;
using namespace piko;

Slots::Slots(OpBuilder &builder, Location loc, Value writer, Value count)
    : loc(loc), count(count) {
  OpBuilder::InsertionGuard guard(builder);
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value any = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::sgt,
                                    count, zero);
  auto outer =
      scf::IfOp::create(builder, loc, TypeRange(), any, /*addElse=*/false);
  builder.setInsertionPoint(outer.thenBlock()->getTerminator());
  mark = ScratchMarkOp::create(builder, loc, writer);
  scratch = ScratchOp::create(builder, loc, writer, zero);
  inner = scf::IfOp::create(builder, loc, TypeRange(), scratch.getGranted(),
                            /*addElse=*/false);
  release = ScratchReleaseOp::create(builder, loc, writer, mark);
}

/// What memory holds for a value: a primitive's address, the byte of a
/// condition, of which vectors have rows, or the value.
static Type getStoredType(Type type) {
  if (type.isInteger(1))
    return IntegerType::get(type.getContext(), 8);
  return isa<PrimType>(type) ? Type(IndexType::get(type.getContext())) : type;
}

static int64_t getByteSize(Type type) {
  if (type.isIndex())
    return 8;
  return llvm::PowerOf2Ceil((type.getIntOrFloatBitWidth() + 7) / 8);
}

bool Slots::canHold(Type type) {
  return isa<PrimType, IndexType>(type) || type.isIntOrFloat();
}

Value Slots::reserve(int64_t bytes) {
  OpBuilder builder(scratch);
  Value place = arith::ConstantIndexOp::create(builder, loc, 0);
  arrays.push_back({place.getDefiningOp(), bytes});
  return place;
}

Value Slots::add(Type type, int64_t elements) {
  Type stored = getStoredType(type);
  Value place = reserve(elements * getByteSize(stored));
  OpBuilder builder = OpBuilder::atBlockBegin(inner.thenBlock());
  Value size = count;
  if (elements != 1)
    size = arith::MulIOp::create(
        builder, loc, count,
        arith::ConstantIndexOp::create(builder, loc, elements));
  return memref::ViewOp::create(builder, loc,
                                MemRefType::get({ShapedType::kDynamic}, stored),
                                scratch.getBytes(), place, size);
}

Value Slots::addArrays(MemRefType type) {
  return reserve(type.getNumElements() * getByteSize(type.getElementType()));
}

Value Slots::getArray(OpBuilder &builder, Value arrays, MemRefType type,
                      Value iteration) {
  int64_t bytes = type.getNumElements() * getByteSize(type.getElementType());
  Value offset = arith::MulIOp::create(
      builder, loc, iteration,
      arith::ConstantIndexOp::create(builder, loc, bytes));
  Value place = arith::AddIOp::create(builder, loc, arrays, offset);
  return memref::ViewOp::create(builder, loc, type, scratch.getBytes(), place,
                                ValueRange());
}

Value Slots::load(OpBuilder &builder, Location loc, Type type, Value slots,
                  Value index) {
  Value stored = memref::LoadOp::create(builder, loc, slots, index);
  if (isa<PrimType>(type))
    return FromAddressOp::create(builder, loc, type, stored);
  if (type != stored.getType())
    return arith::TruncIOp::create(builder, loc, type, stored);
  return stored;
}

void Slots::store(OpBuilder &builder, Location loc, Value value, Value slots,
                  Value index) {
  if (isa<PrimType>(value.getType()))
    value = ToAddressOp::create(builder, loc, value);
  else if (value.getType().isInteger(1))
    value = arith::ExtUIOp::create(builder, loc, builder.getI8Type(), value);
  memref::StoreOp::create(builder, loc, value, slots, index);
}

void Slots::finish() {
  OpBuilder builder(scratch);
  if (arrays.empty()) {
    Value yes =
        arith::ConstantOp::create(builder, loc, builder.getBoolAttr(true));
    inner.getConditionMutable().assign(yes);
    release.erase();
    scratch.erase();
    mark.erase();
    return;
  }
  // Each array starts on a line of its own.
  constexpr int64_t mostIterations = int64_t(1) << 40;
  auto constant = [&](int64_t value) -> Value {
    return arith::ConstantIndexOp::create(builder, loc, value);
  };
  Value size = constant(0);
  for (const Array &array : arrays) {
    array.place->getResult(0).replaceAllUsesWith(size);
    array.place->erase();
    Value bytes =
        arith::MulIOp::create(builder, loc, count, constant(array.bytes));
    bytes = arith::AddIOp::create(builder, loc, bytes, constant(lineSize - 1));
    bytes = arith::AndIOp::create(builder, loc, bytes, constant(-lineSize));
    size = arith::AddIOp::create(builder, loc, size, bytes);
  }
  // A product that wraps must not look small: what is negative is refused.
  Value tooMany = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::sgt,
                                        count, constant(mostIterations));
  size = arith::SelectOp::create(builder, loc, tooMany, constant(-1), size);
  scratch.getSizeMutable().assign(size);
}
