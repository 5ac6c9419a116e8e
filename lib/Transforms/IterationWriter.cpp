// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Predication: each value of an iteration is a scalar, where it is the same for
// all lanes, or a vector. `active` is the mask of the lanes that come here.

#include "IterationWriter.h"

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
  const OrderedGroup &ordered = lanes.getOrdered();
  for (Operation &op : block.without_terminator()) {
    if (ordered && ordered.first->getBlock() == &block &&
        ordered.contains(&op)) {
      if (&op == ordered.first)
        writeOrdered();
      continue;
    }
    writeOperation(&op);
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
  case LaneForm::Private: // made in front of the loop
    return;
  case LaneForm::Structure:
    return writeStructure(op);
  case LaneForm::Lazy:
    return;
  case LaneForm::Serial:
  case LaneForm::Ordered:
    if (!isa<PrefetchOp>(op))
      writeSerial(op, op);
  }
}

void IterationWriter::writeUniform(Operation *op) {
  builder.clone(*op, scalars);
}

/// Whether an operation may trap where its last operand is 0.
static bool isIntegerDivision(Operation *op) {
  return isa<arith::DivSIOp, arith::DivUIOp, arith::RemSIOp, arith::RemUIOp,
             arith::CeilDivSIOp, arith::CeilDivUIOp, arith::FloorDivSIOp>(op);
}

void IterationWriter::writeVector(Operation *op) {
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
  }
  OperationState state(loc, op->getName());
  state.addOperands(operands);
  for (Type type : op->getResultTypes())
    state.addTypes(getVectorType(type));
  state.propertiesAttr = op->getPropertiesAsAttribute();
  Operation *made = builder.create(state);
  for (auto [from, to] : llvm::zip(op->getResults(), made->getResults()))
    setCarried(from, to);
}

//===----------------------------------------------------------------------===//
// Memory
//===----------------------------------------------------------------------===//

void IterationWriter::writePrivate(memref::AllocaOp array) {
  MemRefType type = array.getType();
  OpBuilder arrays(outermost);
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

void IterationWriter::writeArrayAccess(Operation *op) {
  auto load = dyn_cast<memref::LoadOp>(op);
  auto write = dyn_cast<memref::StoreOp>(op);
  Value array = load ? load.getMemRef() : write.getMemRef();
  Value index = load ? load.getIndices()[0] : write.getIndices()[0];
  if (load && lanes.readsFixed(op) && !lanes.isVarying(index)) {
    Value one = memref::LoadOp::create(builder, loc, getUniform(array),
                                       getUniform(index));
    vectors.map(load.getResult(), splat(one));
    return;
  }
  Value base = columns.lookup(array), at;
  bool isRow = false; // of lanes, one behind the other
  if (base) {
    isRow = !lanes.isVarying(index);
    at = getColumns(index);
  } else {
    base = getUniform(array);
    isRow = lanes.isLinear(index);
    at = isRow ? getFirst(index) : get(index);
  }
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

void IterationWriter::writeAccess(Operation *op) {
  if (isa<memref::LoadOp, memref::StoreOp>(op))
    return writeArrayAccess(op);
  auto write = [&](auto access, auto create) {
    ValueRange indices = access.getIndices();
    bool isRow = !indices.empty() && lanes.isLinear(indices.front()) &&
                 llvm::none_of(indices.drop_front(), [&](Value index) {
                   return lanes.isVarying(index);
                 });
    SmallVector<Value> at, elements;
    for (Value index : indices)
      at.push_back(isRow ? getFirst(index) : getCarried(index));
    // Of other integers, as the lanes' places are of type index.
    for (Value &index : at)
      if (Type type = getElementTypeOrSelf(index.getType()); !type.isIndex())
        index = arith::IndexCastOp::create(
            builder, loc,
            isa<VectorType>(index.getType())
                ? Type(getVectorType(builder.getIndexType()))
                : builder.getIndexType(),
            index);
    for (Value element : access.getElements())
      elements.push_back(getUniform(element));
    create(at, elements, isRow);
  };
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

//===----------------------------------------------------------------------===//
// Lane by lane
//===----------------------------------------------------------------------===//

Value IterationWriter::createSlot(Type type) {
  OpBuilder arrays(outermost);
  if (type.isInteger(1))
    type = builder.getI8Type();
  constexpr int64_t lineSize = 64;
  return memref::AllocaOp::create(arrays, loc,
                                  MemRefType::get({laneCount}, type),
                                  arrays.getI64IntegerAttr(lineSize));
}

void IterationWriter::store(Value value, Value slot) {
  auto kept = cast<MemRefType>(slot.getType()).getElementType();
  if (getElementTypeOrSelf(value.getType()) != kept)
    value = arith::ExtUIOp::create(builder, loc, getVectorType(kept), value);
  Value none = arith::ConstantIndexOp::create(builder, loc, 0);
  vector::StoreOp::create(builder, loc, value, slot, none);
}

/// Loads a number of a lane, or of all.
static Value loadSlot(OpBuilder &builder, Location loc, Value slot, Value at,
                      Type type) {
  Type kept = cast<MemRefType>(slot.getType()).getElementType();
  Type element = getElementTypeOrSelf(type);
  auto vector = dyn_cast<VectorType>(type);
  Value value =
      vector ? vector::LoadOp::create(builder, loc,
                                      VectorType::get(vector.getShape(), kept),
                                      slot, at)
                   .getResult()
             : memref::LoadOp::create(builder, loc, slot, at).getResult();
  if (element == kept)
    return value;
  Value zero = arith::ConstantOp::create(builder, loc,
                                         builder.getZeroAttr(value.getType()));
  return arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne, value,
                               zero);
}

/// Whether all that an operation does may be done in front of others.
static bool isMovable(Operation *op, const IterationLanes &lanes) {
  WalkResult result = op->walk([&](Operation *inner) {
    LaneForm form = lanes.getForm(inner);
    bool isFree = inner->hasTrait<OpTrait::IsTerminator>() ||
                  form == LaneForm::Vector || form == LaneForm::Lazy ||
                  form == LaneForm::Uniform || form == LaneForm::Structure ||
                  (form == LaneForm::Access && lanes.readsFixed(inner)) ||
                  (form == LaneForm::Serial && isMemoryEffectFree(inner));
    return isFree ? WalkResult::advance() : WalkResult::interrupt();
  });
  return !result.wasInterrupted();
}

llvm::SetVector<Operation *>
IterationWriter::findMovable(ArrayRef<Operation *> ops) const {
  llvm::SetVector<Operation *> movable;
  llvm::DenseSet<Operation *> inGroup(ops.begin(), ops.end());
  Block *block = ops.front()->getBlock();
  for (Operation *op : ops) {
    bool isReady = isMovable(op, lanes);
    op->walk([&](Operation *inner) {
      for (Value operand : inner->getOperands()) {
        Operation *from = operand.getDefiningOp();
        from = from ? block->findAncestorOpInBlock(*from) : nullptr;
        isReady &= !from || from == op || !inGroup.contains(from) ||
                   movable.contains(from);
      }
    });
    if (isReady)
      movable.insert(op);
  }
  return movable;
}

void IterationWriter::writeOrdered() {
  const OrderedGroup &ordered = lanes.getOrdered();
  SmallVector<Operation *> ops;
  for (Operation *op = ordered.first;; op = op->getNextNode()) {
    ops.push_back(op);
    if (op == ordered.last)
      break;
  }
  for (Operation *op : findMovable(ops))
    writeOperation(op);
  writeSerial(ordered.first, ordered.last);
}

namespace {

/// What operations that run lane by lane take from outside of them.
class SerialInputs {
public:
  SerialInputs(const IterationLanes &lanes, ArrayRef<Operation *> ops)
      : lanes(lanes), ops(ops.begin(), ops.end()) {
    for (Operation *op : ops)
      op->walk([&](Operation *inner) {
        for (Value operand : inner->getOperands())
          add(operand);
      });
  }
  /// Numbers that differ between lanes.
  llvm::SetVector<Value> numbers;
  /// What is made again for each lane, in order.
  llvm::SetVector<Operation *> made;

private:
  bool isInside(Value value) const {
    Operation *at = value.getParentBlock()->getParentOp();
    if (Operation *op = value.getDefiningOp())
      at = op;
    for (; at && at != lanes.getLoop(); at = at->getParentOp())
      if (ops.contains(at))
        return true;
    return false;
  }
  void add(Value value) {
    if (!lanes.isVarying(value) || lanes.isPrivate(value) || isInside(value))
      return;
    if (isNumber(value.getType())) {
      numbers.insert(value);
      return;
    }
    Operation *op = value.getDefiningOp();
    for (Value operand : op->getOperands())
      add(operand);
    made.insert(op);
  }

  const IterationLanes &lanes;
  llvm::DenseSet<Operation *> ops;
};

} // namespace

/// Arrays of an iteration have a column for each lane.
void IterationWriter::useColumns(Operation *copy, Value lane) {
  copy->walk([&](Operation *op) {
    auto load = dyn_cast<memref::LoadOp>(op);
    auto write = dyn_cast<memref::StoreOp>(op);
    Value array = load ? load.getMemRef() : write ? write.getMemRef() : Value();
    Value wide = array ? columns.lookup(array) : Value();
    if (!wide)
      return;
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPoint(op);
    Value index = load ? load.getIndices()[0] : write.getIndices()[0];
    Value stride = arith::ConstantIndexOp::create(builder, loc, laneCount);
    Value at = arith::AddIOp::create(
        builder, loc, arith::MulIOp::create(builder, loc, index, stride), lane);
    (load ? load.getMemrefMutable() : write.getMemrefMutable()).assign(wide);
    (load ? load.getIndicesMutable() : write.getIndicesMutable()).assign(at);
  });
}

SmallVector<Operation *> IterationWriter::findRest(Operation *first,
                                                   Operation *last) const {
  SmallVector<Operation *> ops;
  for (Operation *op = first;; op = op->getNextNode()) {
    bool isDone = llvm::any_of(op->getResults(), [&](Value result) {
      return vectors.contains(result) || scalars.contains(result);
    });
    if (!isDone && !isa<memref::AllocaOp>(op))
      ops.push_back(op);
    if (op == last)
      return ops;
  }
}

/// The results of some operations of a block that others use.
static SmallVector<Value> findOutputs(ArrayRef<Operation *> ops) {
  llvm::DenseSet<Operation *> inside(ops.begin(), ops.end());
  SmallVector<Value> outputs;
  for (Operation *op : ops)
    for (Value result : op->getResults())
      if (llvm::any_of(result.getUsers(), [&](Operation *user) {
            return !inside.contains(
                op->getBlock()->findAncestorOpInBlock(*user));
          }))
        outputs.push_back(result);
  return outputs;
}

void IterationWriter::writeTurns(llvm::function_ref<void(Value lane)> write) {
  // One bit for each lane; the lowest one is the next.
  Type word = builder.getIntegerType(laneCount);
  Value bits = vector::ExtractOp::create(
      builder, loc,
      vector::BitCastOp::create(builder, loc, VectorType::get({1}, word),
                                active),
      ArrayRef<int64_t>{0});
  Value none = zeros(word), one = arith::ConstantOp::create(
                                builder, loc, builder.getIntegerAttr(word, 1));
  auto turns =
      scf::WhileOp::create(builder, loc, TypeRange{word}, ValueRange{bits});
  Block *before = builder.createBlock(&turns.getBefore(), {}, word, loc);
  Value isLeft = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne,
                                       before->getArgument(0), none);
  scf::ConditionOp::create(builder, loc, isLeft, before->getArguments());
  Block *after = builder.createBlock(&turns.getAfter(), {}, word, loc);
  Value left = after->getArgument(0);
  write(arith::IndexCastUIOp::create(
      builder, loc, builder.getIndexType(),
      math::CountTrailingZerosOp::create(builder, loc, left)));
  Value rest = arith::AndIOp::create(
      builder, loc, left, arith::SubIOp::create(builder, loc, left, one));
  scf::YieldOp::create(builder, loc, rest);
  builder.setInsertionPointAfter(turns);
}

void IterationWriter::writeSerial(Operation *first, Operation *last) {
  SmallVector<Operation *> ops = findRest(first, last);
  SerialInputs inputs(lanes, ops);
  SmallVector<Value> outputs = findOutputs(ops);
  llvm::DenseMap<Value, Value> slots;
  for (Value number : inputs.numbers) {
    slots[number] = createSlot(number.getType());
    store(get(number), slots[number]);
  }
  for (Value output : outputs)
    slots[output] = createSlot(output.getType());
  Value start = arith::ConstantIndexOp::create(builder, loc, 0);
  writeTurns([&](Value lane) {
    IRMapping mapping(scalars);
    for (Value number : inputs.numbers)
      mapping.map(number, loadSlot(builder, loc, slots[number], lane,
                                   number.getType()));
    for (Operation *op : inputs.made)
      useColumns(builder.clone(*op, mapping), lane);
    for (Operation *op : ops)
      useColumns(builder.clone(*op, mapping), lane);
    for (Value output : outputs) {
      Value value = mapping.lookup(output);
      Type kept = cast<MemRefType>(slots[output].getType()).getElementType();
      if (value.getType() != kept)
        value = arith::ExtUIOp::create(builder, loc, kept, value);
      memref::StoreOp::create(builder, loc, value, slots[output],
                              lanes.isVarying(output) ? lane : start);
    }
  });
  for (Value output : outputs)
    setCarried(output, loadSlot(builder, loc, slots[output], start,
                                getCarriedType(output)));
}
