// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "LaneWriter.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/TypeUtilities.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Slots
//===----------------------------------------------------------------------===//

/// What memory holds for a value: vectors of single bits take long to pack.
static Type getSlotType(Type type) {
  return type.isInteger(1) ? IntegerType::get(type.getContext(), 8) : type;
}

Value LaneSlots::create(Type type) {
  constexpr int64_t lineSize = 64;
  return memref::AllocaOp::create(
      arrays, loc, MemRefType::get({laneBlockSize}, getSlotType(type)),
      arrays.getI64IntegerAttr(lineSize));
}

VectorType piko::getVectorType(Type type) {
  return VectorType::get({laneCount}, type);
}

void LaneSlots::store(OpBuilder &builder, Value value, Value slot,
                      Value place) const {
  Type type = value.getType(), element = getElementTypeOrSelf(type);
  auto array = cast<MemRefType>(slot.getType());
  bool isVector = isa<VectorType>(type);
  if (element != array.getElementType())
    value =
        arith::ExtUIOp::create(builder, loc,
                               isVector ? getVectorType(array.getElementType())
                                        : array.getElementType(),
                               value);
  if (isVector)
    vector::StoreOp::create(builder, loc, value, slot, place);
  else
    memref::StoreOp::create(builder, loc, value, slot, place);
}

Value LaneSlots::load(OpBuilder &builder, Value slot, Value place,
                      Type type) const {
  Type kept = getSlotType(getElementTypeOrSelf(type));
  Value value =
      isa<VectorType>(type)
          ? vector::LoadOp::create(builder, loc, getVectorType(kept), slot,
                                   place)
                .getResult()
          : memref::LoadOp::create(builder, loc, slot, place).getResult();
  if (kept == getElementTypeOrSelf(type))
    return value;
  Value zero = arith::ConstantOp::create(builder, loc,
                                         builder.getZeroAttr(value.getType()));
  return arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne, value,
                               zero);
}

//===----------------------------------------------------------------------===//
// The loop that reads
//===----------------------------------------------------------------------===//

Value FetchWriter::get(Value value) {
  value = planner.getFirst(value);
  if (Value known = mapping.lookupOrNull(value))
    return known;
  Operation *op = value.getDefiningOp();
  if (!op || !planner.getLoop()->isAncestor(op))
    return value;
  if (auto load = dyn_cast<LoadOp>(op); load && !load.getIndices().empty())
    getElement(load);
  else
    repeat(op);
  return mapping.lookup(value);
}

void FetchWriter::repeat(Operation *op) {
  for (Value operand : op->getOperands())
    mapping.map(operand, get(operand));
  builder.clone(*op, mapping);
}

void FetchWriter::getElement(ArrayRef<LoadOp> loads) {
  LoadOp first = loads.front();
  SmallVector<Value> indices;
  for (Value index : first.getIndices())
    indices.push_back(get(index));
  BinArithmetic bins(builder, loc, stage);
  Value isInside = bins.isInState(first.getState(), indices);
  SmallVector<Type> types;
  for (LoadOp load : loads) {
    types.push_back(load.getType());
    for (Value element : load.getElements())
      get(element);
  }
  auto choice = scf::IfOp::create(builder, loc, types, isInside,
                                  /*addThenBlock=*/true, /*addElseBlock=*/true);
  auto fill = [&](Block *block, auto create) {
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(block);
    SmallVector<Value> values;
    for (LoadOp load : loads)
      values.push_back(create(load));
    scf::YieldOp::create(builder, loc, values);
  };
  fill(choice.thenBlock(), [&](LoadOp load) {
    repeat(load);
    auto copy = mapping.lookup(load.getResult()).getDefiningOp<LoadOp>();
    copy.setChecked(true);
    copy.removeOfAttr(); // so that equal reads are the same
    return copy.getResult();
  });
  fill(choice.elseBlock(), [&](LoadOp load) -> Value {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getZeroAttr(load.getType()));
  });
  for (auto [load, result] : llvm::zip(loads, choice.getResults()))
    mapping.map(LoadOp(load).getResult(), result);
  inside =
      inside ? arith::AndIOp::create(builder, loc, inside, isInside) : isInside;
}

//===----------------------------------------------------------------------===//
// The loop in vectors
//===----------------------------------------------------------------------===//

Value VectorWriter::splat(Value scalar) {
  return vector::BroadcastOp::create(builder, loc,
                                     getVectorType(scalar.getType()), scalar);
}

Value VectorWriter::invert(Value mask) {
  Value yes = arith::ConstantOp::create(
      builder, loc,
      DenseElementsAttr::get(cast<ShapedType>(mask.getType()), true));
  return arith::XOrIOp::create(builder, loc, mask, yes);
}

Value VectorWriter::zeros(Type type) {
  return arith::ConstantOp::create(builder, loc, builder.getZeroAttr(type));
}

Value VectorWriter::getUniform(Value value) {
  return scalars.lookupOrDefault(value);
}

Value VectorWriter::get(Value value) {
  value = planner.getFirst(value);
  if (planner.isInvariant(value))
    return splat(getUniform(value));
  if (Value known = vectors.lookupOrNull(value))
    return known;
  // In front of all, because inner loops may need it first.
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(top);
  Value result;
  if (value == planner.getLoop().getInductionVar()) {
    Value first = arith::AddIOp::create(builder, loc, begin, place);
    Value steps = vector::StepOp::create(builder, loc,
                                         getVectorType(builder.getIndexType()));
    result = arith::AddIOp::create(builder, loc, splat(first), steps);
  } else {
    slots.add(value);
    result = slots.load(builder, slots.get(value), place,
                        getVectorType(value.getType()));
  }
  vectors.map(value, result);
  return result;
}

SmallVector<Value> VectorWriter::getFor(ValueRange variables,
                                        ValueRange values) {
  SmallVector<Value> carried;
  for (auto [variable, value] : llvm::zip_equal(variables, values))
    carried.push_back(planner.isInvariant(variable) ? getUniform(value)
                                                    : get(value));
  carried.push_back(rare ? rare : zeros(getVectorType(builder.getI1Type())));
  return carried;
}

SmallVector<Type> VectorWriter::getTypesFor(ValueRange variables) {
  SmallVector<Type> types;
  for (Value variable : variables)
    types.push_back(planner.isInvariant(variable)
                        ? variable.getType()
                        : getVectorType(variable.getType()));
  types.push_back(getVectorType(builder.getI1Type()));
  return types;
}

void VectorWriter::set(ValueRange variables, ValueRange carried) {
  for (auto [variable, value] : llvm::zip(variables, carried))
    (planner.isInvariant(variable) ? scalars : vectors).map(variable, value);
  rare = carried.back();
}

Value VectorWriter::both(Value mask, Value other) {
  return arith::SelectOp::create(builder, loc, mask, other,
                                 zeros(other.getType()));
}

void VectorWriter::giveUp(Value lanes) {
  if (active)
    lanes = both(active, lanes);
  rare = rare ? arith::OrIOp::create(builder, loc, rare, lanes) : lanes;
}

Value VectorWriter::getPresent() {
  if (present)
    return present;
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(top);
  Value steps = vector::StepOp::create(builder, loc,
                                       getVectorType(builder.getIndexType()));
  Value left = arith::SubIOp::create(builder, loc, count, place);
  Value isThere = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt,
                                        steps, splat(left));
  Value isRead = invert(
      slots.load(builder, outside, place, getVectorType(builder.getI1Type())));
  return present = arith::AndIOp::create(builder, loc, isThere, isRead);
}

void VectorWriter::write(const LanePlan &plan) {
  for (Operation *op : plan.ahead)
    writeOperation(op);
  for (const LaneBranch &branch : plan.branches) {
    scf::IfOp choice = branch.choice;
    Value condition = get(choice.getCondition());
    writeFor(branch.region == 0 ? condition : invert(condition),
             [&] { write(branch.plan); });
  }
}

void VectorWriter::writeFor(Value lanes, llvm::function_ref<void()> write) {
  Value outer = active;
  active = outer ? both(outer, lanes) : lanes;
  write();
  active = outer;
}

void VectorWriter::writeOperations(Block &block) {
  for (Operation &op : block.without_terminator())
    writeOperation(&op);
}

void VectorWriter::writeUniform(Operation *op) {
  if (auto load = dyn_cast<LoadOp>(op); load && !load.getIndices().empty())
    return writeUniform(load);
  for (Value operand : op->getOperands())
    scalars.map(operand, getUniform(operand));
  builder.clone(*op, scalars);
}

void VectorWriter::writeUniform(LoadOp load) {
  SmallVector<Value> indices;
  for (Value index : load.getIndices())
    indices.push_back(getUniform(index));
  BinArithmetic bins(builder, loc, stage);
  Value isInside = bins.isInState(load.getState(), indices);
  auto choice = scf::IfOp::create(builder, loc, load.getType(), isInside,
                                  /*addThenBlock=*/true, /*addElseBlock=*/true);
  {
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(choice.thenBlock());
    auto copy = cast<LoadOp>(builder.clone(*load, scalars));
    copy.setChecked(true);
    copy.removeOfAttr(); // so that equal reads are the same
    scf::YieldOp::create(builder, loc, copy.getResult());
    builder.setInsertionPointToStart(choice.elseBlock());
    scf::YieldOp::create(builder, loc, zeros(load.getType()));
  }
  scalars.map(load.getResult(), choice.getResult(0));
  giveUp(invert(splat(isInside)));
}

void VectorWriter::writeOperation(Operation *op) {
  if (auto choice = dyn_cast<scf::IfOp>(op))
    return writeCondition(choice);
  if (auto loop = dyn_cast<scf::WhileOp>(op))
    return writeLoopIfNeeded(loop);
  Value first = op->getResult(0);
  if (planner.isInvariant(first))
    return writeUniform(op);
  if (planner.isFetched(first))
    return; // was read
  IRMapping operands;
  for (Value operand : op->getOperands())
    operands.map(operand, get(operand));
  Operation *copy = builder.clone(*op, operands);
  for (auto [from, to] : llvm::zip(op->getResults(), copy->getResults())) {
    to.setType(getVectorType(from.getType()));
    vectors.map(from, to);
  }
}

void VectorWriter::writeCondition(scf::IfOp choice) {
  Value condition = get(choice.getCondition());
  SmallVector<Value> values[2]; // of either side
  for (Region &region : choice->getRegions()) {
    unsigned side = region.getRegionNumber();
    Value lanes = side == 0 ? condition : invert(condition);
    writeFor(lanes, [&] {
      if (planner.isRare(region))
        return giveUp(active);
      writeOperations(region.front());
      for (Value value : region.front().getTerminator()->getOperands())
        values[side].push_back(get(value));
    });
  }
  for (auto [i, result] : llvm::enumerate(choice.getResults())) {
    // What a lane gets that gives up does not matter.
    Value value = values[0].empty() ? values[1][i]
                  : values[1].empty()
                      ? values[0][i]
                      : arith::SelectOp::create(builder, loc, condition,
                                                values[0][i], values[1][i])
                            .getResult();
    vectors.map(result, value);
  }
}

void VectorWriter::writeLoop(scf::WhileOp loop) {
  OpBuilder::InsertionGuard guard(builder);
  auto copy = scf::WhileOp::create(
      builder, loc, getTypesFor(loop.getResults()),
      getFor(loop.getBeforeArguments(), loop.getInits()),
      [&](OpBuilder &body, Location, ValueRange carried) {
        builder.setInsertionPointToStart(body.getInsertionBlock());
        set(loop.getBeforeArguments(), carried);
        writeOperations(*loop.getBeforeBody());
        scf::ConditionOp condition = loop.getConditionOp();
        scf::ConditionOp::create(
            builder, loc, getUniform(condition.getCondition()),
            getFor(loop.getResults(), condition.getArgs()));
      },
      [&](OpBuilder &body, Location, ValueRange carried) {
        builder.setInsertionPointToStart(body.getInsertionBlock());
        set(loop.getAfterArguments(), carried);
        writeOperations(*loop.getAfterBody());
        scf::YieldOp::create(
            builder, loc,
            getFor(loop.getBeforeArguments(), loop.getYieldOp().getResults()));
      });
  set(loop.getResults(), copy.getResults());
}

void VectorWriter::writeLoopIfNeeded(scf::WhileOp loop) {
  if (!active)
    return writeLoop(loop);
  // A lane without numbers of its own must not enter it: it may not end.
  Value entering = rare ? both(invert(rare), active) : active;
  entering = both(getPresent(), entering);
  Value isNeeded = vector::ReductionOp::create(
      builder, loc, vector::CombiningKind::OR, entering);
  SmallVector<Type> types = getTypesFor(loop.getResults());
  auto choice = scf::IfOp::create(builder, loc, types, isNeeded,
                                  /*addThenBlock=*/true, /*addElseBlock=*/true);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(choice.elseBlock());
  SmallVector<Value> values;
  for (Type type : ArrayRef(types).drop_back())
    values.push_back(zeros(type));
  values.push_back(rare ? rare : zeros(types.back()));
  scf::YieldOp::create(builder, loc, values);
  builder.setInsertionPointToStart(choice.thenBlock());
  writeLoop(loop);
  scf::YieldOp::create(builder, loc,
                       getFor(loop.getResults(), loop.getResults()));
  set(loop.getResults(), choice.getResults());
}
