// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Vectorize/Write/LaneMemory.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/TypeUtilities.h"

using namespace mlir;
using namespace piko;

void LaneMemory::writePrivate(memref::AllocaOp array) {
  MemRefType type = array.getType();
  OpBuilder arrays(outermost);
  if (!lanes.isVarying(array)) {
    arrays.clone(*array, scalars);
    return;
  }
  columns[array] = memref::AllocaOp::create(
      arrays, loc,
      MemRefType::get({type.getNumElements() * laneCount},
                      type.getElementType()),
      arrays.getI64IntegerAttr(lineSize));
}

Value LaneMemory::getColumns(Value index) {
  Value count = arith::ConstantIndexOp::create(builder, loc, laneCount);
  if (!lanes.isVarying(index))
    return arith::MulIOp::create(builder, loc, getUniform(index), count);
  Value steps = vector::StepOp::create(builder, loc,
                                       getVectorType(builder.getIndexType()));
  Value rows = arith::MulIOp::create(builder, loc, get(index), splat(count));
  return arith::AddIOp::create(builder, loc, rows, steps);
}

/// A row of an array with a column for each lane.
Value LaneMemory::readRow(Value columns, Value row) {
  return vector::LoadOp::create(
      builder, loc,
      getVectorType(cast<MemRefType>(columns.getType()).getElementType()),
      columns, row);
}

/// Writes the lanes of a mask. All of the row is the lanes' own: what stands in
/// its others is written again, so that LLVM can keep it in a register.
void LaneMemory::writeRow(Value columns, Value row, Value mask, Value value) {
  vector::StoreOp::create(
      builder, loc, choose(mask, value, readRow(columns, row)), columns, row);
}

/// An access to a short array of a lane at places that differ: all rows, as a
/// scatter takes about as long as that many stores, and what it wrote is not
/// forwarded to reads.
void LaneMemory::writeShortArrayAccess(Operation *op, Value index) {
  auto load = dyn_cast<memref::LoadOp>(op);
  Value array = load ? load.getMemRef() : cast<memref::StoreOp>(op).getMemRef();
  Value base = columns.lookup(array), value;
  Type word = getVectorType(builder.getI32Type());
  Value at = arith::IndexCastOp::create(builder, loc, word, get(index));
  int64_t count = cast<MemRefType>(array.getType()).getNumElements();
  for (int64_t i = 0; i < count; ++i) {
    Value row = arith::ConstantIndexOp::create(builder, loc, i * laneCount);
    Value isHere = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::eq,
                                         at, number(i));
    if (load) {
      Value here = readRow(base, row);
      value = value ? choose(isHere, here, value) : here;
    } else {
      writeRow(base, row, both(active, isHere),
               get(cast<memref::StoreOp>(op).getValue()));
    }
  }
  if (load)
    vectors.map(load.getResult(), value);
}

void LaneMemory::writePrivateAccess(Operation *op) {
  auto load = dyn_cast<memref::LoadOp>(op);
  auto write = dyn_cast<memref::StoreOp>(op);
  Value array = load ? load.getMemRef() : write.getMemRef();
  Value index = load ? load.getIndices()[0] : write.getIndices()[0];
  Value base = columns.lookup(array);
  if (lanes.isVarying(index) && lanes.isShort(array))
    return writeShortArrayAccess(op, index);
  Value at = getColumns(index);
  if (!lanes.isVarying(index)) {
    if (load)
      vectors.map(load.getResult(), readRow(base, at));
    else
      writeRow(base, at, active, get(write.getValue()));
    return;
  }
  Value none = arith::ConstantIndexOp::create(builder, loc, 0);
  if (write) {
    vector::ScatterOp::create(builder, loc, /*resultType=*/Type(), base, none,
                              at, active, get(write.getValue()));
    return;
  }
  VectorType type = getVectorType(load.getType());
  vectors.map(load.getResult(),
              vector::GatherOp::create(builder, loc, type, base, none, at,
                                       active, zeros(type))
                  .getResult());
}

/// Of an array that iterations share.
void LaneMemory::writeArrayAccess(Operation *op) {
  auto load = dyn_cast<memref::LoadOp>(op);
  auto write = dyn_cast<memref::StoreOp>(op);
  Value array = load ? load.getMemRef() : write.getMemRef();
  Value index = load ? load.getIndices()[0] : write.getIndices()[0];
  if (columns.contains(array))
    return writePrivateAccess(op);
  if (load && lanes.readsFixed(op) && !lanes.isVarying(index)) {
    Value one = memref::LoadOp::create(builder, loc, getUniform(array),
                                       getUniform(index));
    vectors.map(load.getResult(), splat(one));
    return;
  }
  Value base = getUniform(array);
  bool isRow = !paired && lanes.isLinear(index); // one after the other
  Value at = isRow ? getFirst(index) : get(index);
  VectorType lanesType =
      getVectorType(cast<MemRefType>(base.getType()).getElementType());
  Value none = arith::ConstantIndexOp::create(builder, loc, 0);
  if (write) {
    Value value = get(write.getValue());
    if (isRow)
      vector::MaskedStoreOp::create(builder, loc, base, at, active, value);
    else
      vector::ScatterOp::create(builder, loc, /*resultType=*/Type(), base, none,
                                at, active, value);
    return;
  }
  Value nothing = zeros(lanesType), value;
  if (isRow)
    value = vector::MaskedLoadOp::create(builder, loc, lanesType, base, at,
                                         active, nothing);
  else
    value = vector::GatherOp::create(builder, loc, lanesType, base, none, at,
                                     active, nothing);
  vectors.map(load.getResult(), value);
}

void LaneMemory::writeItemAccess(Operation *op) {
  if (auto item = dyn_cast<ItemOp>(op)) {
    Value position = item.getPosition();
    position = !paired && lanes.isLinear(position) ? getFirst(position)
                                                   : get(position);
    vectors.map(item.getPrim(),
                LaneItemsOp::create(builder, loc, getVectorType(item.getType()),
                                    getUniform(item.getBins()), position,
                                    active));
    return;
  }
  auto get = cast<GetOp>(op);
  SmallVector<Value> elements;
  for (Value element : get.getElements())
    elements.push_back(getUniform(element));
  vectors.map(get.getResult(),
              LaneGetOp::create(builder, loc, getVectorType(get.getType()),
                                this->get(get.getPrim()), get.getFieldAttr(),
                                elements, get.getPrim().getType().getRecord(),
                                active));
}

bool LaneMemory::isRowOf(ValueRange indices) const {
  return !paired && !indices.empty() && lanes.isLinear(indices.front()) &&
         llvm::none_of(indices.drop_front(),
                       [&](Value index) { return lanes.isVarying(index); });
}

SmallVector<Value> LaneMemory::getPlaces(ValueRange indices) {
  bool isRow = isRowOf(indices);
  SmallVector<Value> at;
  for (Value index : indices)
    at.push_back(isRow ? getFirst(index) : getCarried(index));
  for (Value &index : at)
    if (Type type = getElementTypeOrSelf(index.getType()); !type.isIndex())
      index = arith::IndexCastOp::create(
          builder, loc,
          isa<VectorType>(index.getType())
              ? Type(getVectorType(builder.getIndexType()))
              : builder.getIndexType(),
          index);
  return at;
}

/// How many lanes push: the active ones, but no more than there is room for.
Value LaneMemory::countPushed(PushOp push, Value count) {
  CodeBuilder at(builder, loc);
  Type word = builder.getI64Type();
  Value pushed = arith::ExtUIOp::create(
      builder, loc, word, math::CtPopOp::create(builder, loc, getBits(active)));
  if (!push.getLimit())
    return pushed;
  auto widen = [&](Value number) -> Value {
    if (number.getType() == word)
      return number;
    if (number.getType().isIndex())
      return arith::IndexCastOp::create(builder, loc, word, number);
    if (push.getIsUnsigned())
      return arith::ExtUIOp::create(builder, loc, word, number);
    return arith::ExtSIOp::create(builder, loc, word, number);
  };
  Value limit = widen(getUniform(push.getLimit())), known = widen(count);
  Value hasRoom = at.compare(push.getIsUnsigned() ? CodeBuilder::P::ult
                                                  : CodeBuilder::P::slt,
                             known, limit);
  Value none =
      arith::ConstantOp::create(builder, loc, builder.getIntegerAttr(word, 0));
  Value room = at.select(hasRoom, at.sub(limit, known), none);
  return arith::MinUIOp::create(builder, loc, pushed, room);
}

/// Where a vector is stored to a padded list: where that is full, or was too
/// long already, to what pads it.
Value LaneMemory::getPaddedPlace(PushOp push, Value array, Value place) {
  if (!push.getLimit())
    return place;
  int64_t size = cast<MemRefType>(array.getType()).getNumElements() - laneCount;
  return arith::MinUIOp::create(
      builder, loc, place, arith::ConstantIndexOp::create(builder, loc, size));
}

void LaneMemory::writePush(PushOp push) {
  CodeBuilder at(builder, loc);
  Value memory = getUniform(push.getCount()), zero = at.index(0);
  Value count = at.load(memory, zero);
  Value pushed = countPushed(push, count), place = count;
  auto isPushed = [&] {
    return getFirstLanes(
        arith::TruncIOp::create(builder, loc, builder.getI32Type(), pushed));
  };
  if (!count.getType().isIndex())
    place =
        arith::IndexCastOp::create(builder, loc, builder.getIndexType(), count);
  for (auto [value, array] : llvm::zip(push.getValues(), push.getArrays())) {
    Value first = CompressOp::create(builder, loc, get(value), active);
    if (push.getPadded())
      vector::StoreOp::create(builder, loc, first, getUniform(array),
                              getPaddedPlace(push, array, place));
    else
      vector::MaskedStoreOp::create(builder, loc, getUniform(array), place,
                                    isPushed(), first);
  }
  Type type = count.getType();
  if (type.isIndex())
    pushed = arith::IndexCastOp::create(builder, loc, type, pushed);
  else if (type != pushed.getType())
    pushed = arith::TruncIOp::create(builder, loc, type, pushed);
  at.store(at.add(count, pushed), memory, zero);
}

void LaneMemory::writeAccess(Operation *op) {
  if (auto push = dyn_cast<PushOp>(op))
    return writePush(push);
  if (isa<memref::LoadOp, memref::StoreOp>(op))
    return writeArrayAccess(op);
  if (isa<ItemOp, GetOp>(op))
    return writeItemAccess(op);
  if (auto prefetch = dyn_cast<PrefetchOp>(op))
    return writePrefetch(prefetch);
  auto write = [&](auto access, auto create) {
    ValueRange indices = access.getIndices();
    bool isRow = isRowOf(indices);
    SmallVector<Value> at = getPlaces(indices), elements;
    for (Value element : access.getElements())
      elements.push_back(getUniform(element));
    create(at, elements, isRow);
  };
  if (Value limited = paired ? Value() : lanes.findLimited(op))
    return writeLimited(cast<LoadOp>(op), limited);
  if (auto load = dyn_cast<LoadOp>(op))
    write(load, [&](ValueRange at, ValueRange elements, bool isRow) {
      vectors.map(load.getResult(),
                  GatherOp::create(builder, loc, getVectorType(load.getType()),
                                   load.getStateAttr(), at, load.getFieldAttr(),
                                   elements, active,
                                   isRow ? builder.getUnitAttr() : UnitAttr())
                      .getResult());
    });
  else if (auto change = dyn_cast<StoreOp>(op))
    write(change, [&](ValueRange at, ValueRange elements, bool isRow) {
      ScatterOp::create(builder, loc, get(change.getValue()),
                        change.getStateAttr(), at, change.getFieldAttr(),
                        elements, active,
                        isRow ? builder.getUnitAttr() : UnitAttr());
    });
}
