// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Predication: what one operation of an iteration becomes.

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

/// An extent, or the least of several.
static bool isExtent(Value value) {
  if (auto least = value.getDefiningOp<arith::MinUIOp>())
    return isExtent(least.getLhs()) && isExtent(least.getRhs());
  return value.getDefiningOp<ExtentOp>() != nullptr;
}

/// Whether an index is inside of an extent, by its 32 bits: vectors of 64 bits
/// are two, and take as long again to bring together.
bool IterationWriter::writeInside(arith::CmpIOp compare) {
  auto index = compare.getLhs().getDefiningOp<arith::IndexCastOp>();
  Value extent = compare.getRhs();
  if (compare.getPredicate() != arith::CmpIPredicate::ult || !index ||
      !index.getIn().getType().isInteger(32) || lanes.isVarying(extent) ||
      !lanes.isVarying(index.getIn()) || !isExtent(extent))
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
  if (auto elect = dyn_cast<ElectOp>(op))
    return writeElect(elect);
  if (auto vote = dyn_cast<VoteOp>(op))
    return writeVote(vote);
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

void IterationWriter::writeOrdered(const OrderedGroup &group) {
  for (Operation *op : lanes.findMovable(group.getOperations()))
    writeOperation(op);
  if (group.late)
    delay(group);
  else
    writeSerial(group.first, group.last);
}
