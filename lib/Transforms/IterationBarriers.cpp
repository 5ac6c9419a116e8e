// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where lanes meet: as many iterations as a vector has lanes, or fewer, are at
// one place at a time, and what they exchange stays in registers.

#include "IterationWriter.h"

#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/Matchers.h"
#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;

using Kind = vector::CombiningKind;

/// What a vector's lanes are combined by, if their order does not matter.
static std::optional<Kind> getKind(ReduceOp reduce) {
  Block &body = reduce.getBody().front();
  Operation *op = &body.front();
  if (reduce.getNumResults() != 1 || op->getNumOperands() != 2 ||
      op->getNextNode() != body.getTerminator() ||
      body.getTerminator()->getOperand(0) != op->getResult(0))
    return std::nullopt;
  bool isOfBoth = op->getOperand(0) != op->getOperand(1) &&
                  llvm::all_of(op->getOperands(), [&](Value operand) {
                    return operand.getParentBlock() == &body;
                  });
  if (!isOfBoth)
    return std::nullopt;
  return llvm::TypeSwitch<Operation *, std::optional<Kind>>(op)
      .Case([](arith::AddIOp) { return Kind::ADD; })
      .Case([](arith::AndIOp) { return Kind::AND; })
      .Case([](arith::OrIOp) { return Kind::OR; })
      .Case([](arith::XOrIOp) { return Kind::XOR; })
      .Case([](arith::MinSIOp) { return Kind::MINSI; })
      .Case([](arith::MaxSIOp) { return Kind::MAXSI; })
      .Case([](arith::MinUIOp) { return Kind::MINUI; })
      .Case([](arith::MaxUIOp) { return Kind::MAXUI; })
      .Default([](Operation *) { return std::nullopt; });
}

SmallVector<Value> IterationWriter::combine(Block &body, ValueRange left,
                                            ValueRange right) {
  IRMapping mapping;
  SmallVector<Value> pair(left);
  llvm::append_range(pair, right);
  mapping.map(body.getArguments(), pair);
  auto lookUp = [&](Value value) {
    Value known = mapping.lookupOrNull(value);
    return known ? known : splat(getUniform(value));
  };
  for (Operation &op : body.without_terminator()) {
    SmallVector<Value> operands = llvm::map_to_vector(op.getOperands(), lookUp);
    Operation *made = createVector(&op, operands);
    mapping.map(op.getResults(), made->getResults());
  }
  return llvm::map_to_vector(body.getTerminator()->getOperands(), lookUp);
}

SmallVector<Value> IterationWriter::combineLanes(ReduceOp reduce) {
  int64_t count = *getConstantIntValue(loop.getUpperBound());
  SmallVector<Value> values;
  for (Value value : reduce.getValues())
    values.push_back(get(value));
  for (int64_t distance = 1; distance < count; distance *= 2) {
    SmallVector<int64_t> from;
    SmallVector<bool> hasOther;
    for (int64_t lane = 0; lane < laneCount; ++lane) {
      hasOther.push_back(lane + distance < count);
      from.push_back(hasOther.back() ? lane + distance : lane);
    }
    auto others = llvm::map_to_vector(values, [&](Value value) -> Value {
      return vector::ShuffleOp::create(builder, loc, value, value, from);
    });
    Value mask = arith::ConstantOp::create(
        builder, loc,
        DenseElementsAttr::get(getVectorType(builder.getI1Type()), hasOther));
    SmallVector<Value> both = combine(reduce.getBody().front(), values, others);
    // The first lane has another one, if any has.
    bool isFull = llvm::isPowerOf2_64(count);
    for (auto [value, next] : llvm::zip(values, both))
      value = isFull ? next : choose(mask, next, value);
  }
  return llvm::map_to_vector(values, [&](Value value) -> Value {
    return vector::ExtractOp::create(builder, loc, value, 0);
  });
}

void IterationWriter::writeReduce(ReduceOp reduce) {
  int64_t count = *getConstantIntValue(loop.getUpperBound());
  std::optional<Kind> kind = getKind(reduce);
  SmallVector<Value> results;
  if (kind && count == laneCount)
    results.push_back(vector::ReductionOp::create(
        builder, loc, *kind, get(reduce.getValues().front())));
  else
    results = combineLanes(reduce);
  for (auto [from, to] : llvm::zip(reduce.getResults(), results))
    scalars.map(from, to);
}
