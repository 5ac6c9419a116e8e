// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Predication: each value of an iteration is a scalar, where it is the same for
// all lanes, or a vector. `active` is the mask of the lanes that come here.

#include "Vectorize/Write/IterationWriter.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/Matchers.h"
#include "mlir/IR/TypeUtilities.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Values
//===----------------------------------------------------------------------===//

Value IterationWriter::splat(Value scalar) {
  if (isa<PrimType>(scalar.getType()))
    scalar = ToAddressOp::create(builder, loc, scalar);
  return vector::BroadcastOp::create(builder, loc,
                                     getVectorType(scalar.getType()), scalar);
}

Value IterationWriter::zeros(Type type) {
  return arith::ConstantOp::create(builder, loc, builder.getZeroAttr(type));
}

Value IterationWriter::invert(Value mask) {
  Value yes = arith::ConstantOp::create(
      builder, loc,
      DenseElementsAttr::get(cast<ShapedType>(mask.getType()), true));
  return arith::XOrIOp::create(builder, loc, mask, yes);
}

Value IterationWriter::choose(Value mask, Value yes, Value no) {
  return yes == no ? yes : arith::SelectOp::create(builder, loc, mask, yes, no);
}

Value IterationWriter::both(Value mask, Value other) {
  return choose(mask, other, zeros(mask.getType()));
}

Value IterationWriter::any(Value mask) {
  return vector::ReductionOp::create(builder, loc, vector::CombiningKind::OR,
                                     mask);
}

Value IterationWriter::get(Value value) {
  if (Value known = vectors.lookupOrNull(value))
    return known;
  assert(!lanes.isVarying(value) && "expected what varies to be computed");
  return splat(getUniform(value));
}

Type IterationWriter::getCarriedType(Value value) const {
  return lanes.isVarying(value) ? Type(getVectorType(value.getType()))
                                : value.getType();
}

void IterationWriter::setCarried(Value value, Value carried) {
  (lanes.isVarying(value) ? vectors : scalars).map(value, carried);
}

Value IterationWriter::getFirst(Value value) {
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

//===----------------------------------------------------------------------===//
// Operations
//===----------------------------------------------------------------------===//

void IterationWriter::writeBlock(Block &block) {
  Operation *end = block.getTerminator();
  for (Operation *op = &block.front(); op != end; op = op->getNextNode()) {
    const OrderedGroup *group = lanes.findGroup(op);
    if (group && group->first->getBlock() == &block) {
      if (op == group->first)
        writeOrdered(*group);
    } else if (SmallVector<LoadOp> fields = findFields(op); !fields.empty()) {
      writeFields(fields);
      op = fields.back();
    } else {
      writeOperation(op);
    }
  }
}

void IterationWriter::writeOperation(Operation *op) {
  switch (lanes.getForm(op)) {
  case LaneForm::Uniform:
    return writeUniform(op);
  case LaneForm::Vector:
    return writeVector(op);
  case LaneForm::Access:
    return writeAccess(op);
  case LaneForm::Private: // made before the loop
    return;
  case LaneForm::Barrier:
    return writeBarrier(op);
  case LaneForm::Structure:
    return writeStructure(op);
  case LaneForm::Lazy:
    return;
  case LaneForm::Serial:
  case LaneForm::Ordered:
    if (!paired && lanes.isPrivateRow(op))
      return writePrivateRow(cast<AtomicOp>(op));
    if (canStage(op))
      return writeStaged(cast<AtomicOp>(op));
    writeSerial(op, op);
  }
}

void IterationWriter::writeUniform(Operation *op) {
  if (!isa<memref::AllocaOp>(op)) // made before the loop
    builder.clone(*op, scalars);
}

/// A product of a number that grows by one from lane to lane and of one that is
/// the same for all: what is added from lane to lane is known before loops
/// over rows, and 64-bit products of vectors take long.
bool IterationWriter::writeLinearProduct(arith::MulIOp product) {
  Value number = product.getLhs(), factor = product.getRhs();
  if (lanes.isVarying(factor))
    std::swap(number, factor);
  if (paired || lanes.isVarying(factor) || !lanes.isSum(number))
    return false;
  Value scalar = getUniform(factor);
  Type type = getVectorType(scalar.getType());
  Value first = arith::MulIOp::create(builder, loc, getFirst(number), scalar);
  Value steps = vector::StepOp::create(builder, loc,
                                       getVectorType(builder.getIndexType()));
  if (type != steps.getType())
    steps = arith::IndexCastOp::create(builder, loc, type, steps);
  vectors.map(product.getResult(),
              arith::AddIOp::create(
                  builder, loc, splat(first),
                  arith::MulIOp::create(builder, loc, steps, splat(scalar))));
  return true;
}

/// The quotient of 32-bit numbers as one of 64-bit floats: what it is above an
/// integer, or below, is more than its rounding error. There is no instruction
/// for vectors of integers. By a divisor that all lanes share, the dividend
/// and a half are multiplied: that quotient is at least half of the divisor's
/// reciprocal away from an integer, which is more than two rounding errors.
Value IterationWriter::divideAsFloats(Operation *division, Value dividend,
                                      Value divisor) {
  bool isSigned = isa<arith::DivSIOp, arith::RemSIOp>(division);
  auto toFloat = [&](Value number) -> Value {
    Type type = builder.getF64Type();
    if (isa<VectorType>(number.getType()))
      type = getVectorType(type);
    if (isSigned)
      return arith::SIToFPOp::create(builder, loc, type, number);
    return arith::UIToFPOp::create(builder, loc, type, number);
  };
  Value quotient, number = toFloat(dividend);
  if (Value shared = division->getOperand(1); !lanes.isVarying(shared)) {
    auto constant = [&](double value) -> Value {
      return arith::ConstantOp::create(builder, loc,
                                       builder.getF64FloatAttr(value));
    };
    Value half = splat(constant(0.5));
    if (isSigned)
      half = math::CopySignOp::create(builder, loc, half, number);
    Value reciprocal = arith::DivFOp::create(builder, loc, constant(1),
                                             toFloat(getUniform(shared)));
    quotient = arith::MulFOp::create(
        builder, loc, arith::AddFOp::create(builder, loc, number, half),
        splat(reciprocal));
  } else {
    quotient = arith::DivFOp::create(builder, loc, number, toFloat(divisor));
  }
  if (isSigned)
    return arith::FPToSIOp::create(builder, loc, dividend.getType(), quotient);
  return arith::FPToUIOp::create(builder, loc, dividend.getType(), quotient);
}

/// Whether an index is inside of an extent, by its 32 bits: vectors of 64 bits
/// are two, and take as long again to bring together.
bool IterationWriter::writeInside(arith::CmpIOp compare) {
  auto index = compare.getLhs().getDefiningOp<arith::IndexCastOp>();
  Value extent = compare.getRhs();
  if (compare.getPredicate() != arith::CmpIPredicate::ult || !index ||
      !index.getIn().getType().isInteger(32) || lanes.isVarying(extent) ||
      !lanes.isVarying(index.getIn()) || !extent.getDefiningOp<ExtentOp>())
    return false;
  // A negative index is, without its sign, this much or more.
  constexpr int64_t most = int64_t(1) << 31;
  Value limit = arith::MinUIOp::create(
      builder, loc, getUniform(extent),
      arith::ConstantIndexOp::create(builder, loc, most));
  limit = arith::IndexCastOp::create(builder, loc, builder.getI32Type(), limit);
  vectors.map(compare.getResult(),
              arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ult,
                                    get(index.getIn()), splat(limit)));
  return true;
}

void IterationWriter::writeVector(Operation *op) {
  if (auto compare = dyn_cast<arith::CmpIOp>(op))
    if (writeInside(compare))
      return;
  if (auto product = dyn_cast<arith::MulIOp>(op))
    if (writeLinearProduct(product))
      return;
  SmallVector<Value> operands;
  for (Value operand : op->getOperands())
    operands.push_back(get(operand));
  if (isIntegerDivision(op) && !matchPattern(op->getOperand(1), m_Constant())) {
    // Lanes that do not come here divide by 1.
    auto type = cast<VectorType>(operands[1].getType());
    Value one = arith::ConstantOp::create(
        builder, loc,
        DenseElementsAttr::get(
            type, builder.getIntegerAttr(type.getElementType(), 1)));
    operands[1] = choose(active, operands[1], one);
    if (isDividedAsFloats(op)) {
      Value value = divideAsFloats(op, operands[0], operands[1]);
      if (isa<arith::RemUIOp, arith::RemSIOp>(op))
        value = arith::SubIOp::create(
            builder, loc, operands[0],
            arith::MulIOp::create(builder, loc, value, operands[1]));
      vectors.map(op->getResult(0), value);
      return;
    }
  }
  for (auto [from, to] :
       llvm::zip(op->getResults(), createVector(op, operands)->getResults()))
    setCarried(from, to);
}

Operation *IterationWriter::createVector(Operation *op, ValueRange operands) {
  OperationState state(loc, op->getName());
  state.addOperands(operands);
  for (Type type : op->getResultTypes())
    state.addTypes(getVectorType(type));
  state.propertiesAttr = op->getPropertiesAsAttribute();
  return builder.create(state);
}

//===----------------------------------------------------------------------===//
// Memory
//===----------------------------------------------------------------------===//

void IterationWriter::writePrivate(memref::AllocaOp array) {
  MemRefType type = array.getType();
  OpBuilder arrays(outermost);
  if (!lanes.isVarying(array)) {
    arrays.clone(*array, scalars);
    return;
  }
  constexpr int64_t lineSize = 64;
  columns[array] = memref::AllocaOp::create(
      arrays, loc,
      MemRefType::get({type.getNumElements() * laneCount},
                      type.getElementType()),
      arrays.getI64IntegerAttr(lineSize));
}

Value IterationWriter::getColumns(Value index) {
  Value count = arith::ConstantIndexOp::create(builder, loc, laneCount);
  if (!lanes.isVarying(index))
    return arith::MulIOp::create(builder, loc, getUniform(index), count);
  Value steps = vector::StepOp::create(builder, loc,
                                       getVectorType(builder.getIndexType()));
  Value rows = arith::MulIOp::create(builder, loc, get(index), splat(count));
  return arith::AddIOp::create(builder, loc, rows, steps);
}

/// A row of an array with a column for each lane.
Value IterationWriter::readRow(Value columns, Value row) {
  return vector::LoadOp::create(
      builder, loc,
      getVectorType(cast<MemRefType>(columns.getType()).getElementType()),
      columns, row);
}

/// Writes the lanes of a mask. All of the row is the lanes' own: what stands in
/// its others is written again, so that LLVM can keep it in a register.
void IterationWriter::writeRow(Value columns, Value row, Value mask,
                               Value value) {
  vector::StoreOp::create(
      builder, loc, choose(mask, value, readRow(columns, row)), columns, row);
}

/// An access to a short array of a lane at places that differ: all rows, as a
/// scatter takes about as long as that many stores, and what it wrote is not
/// forwarded to reads.
void IterationWriter::writeShortArrayAccess(Operation *op, Value index) {
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

void IterationWriter::writePrivateAccess(Operation *op) {
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
void IterationWriter::writeArrayAccess(Operation *op) {
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

void IterationWriter::writeItemAccess(Operation *op) {
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

bool IterationWriter::isRowOf(ValueRange indices) const {
  return !paired && !indices.empty() && lanes.isLinear(indices.front()) &&
         llvm::none_of(indices.drop_front(),
                       [&](Value index) { return lanes.isVarying(index); });
}

SmallVector<Value> IterationWriter::getPlaces(ValueRange indices) {
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

void IterationWriter::writeAccess(Operation *op) {
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
