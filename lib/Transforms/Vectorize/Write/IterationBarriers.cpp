// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where lanes meet: as many iterations as a vector has lanes, or fewer, are at
// one place at a time, and what they exchange stays in registers.

#include "Piko/Transforms/Storage/Collectives.h"
#include "Vectorize/Write/IterationWriter.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"

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
  SmallVector<Value> values = getAll(reduce.getValues());
  for (int64_t distance = 1; distance < count; distance *= 2) {
    auto hasOther = [&](int64_t lane) { return lane + distance < count; };
    SmallVector<int64_t> from;
    for (int64_t lane = 0; lane < laneCount; ++lane)
      from.push_back(hasOther(lane) ? lane + distance : lane);
    SmallVector<Value> others = shuffle(values, from);
    SmallVector<Value> both = combine(reduce.getBody().front(), values, others);
    // The first lane has another one, if any has.
    Value mask = llvm::isPowerOf2_64(count) ? Value() : createMask(hasOther);
    for (auto [value, next] : llvm::zip(values, both))
      value = mask ? choose(mask, next, value) : next;
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

/// Blocks of 2^k values are combined as by a reduction, each in the lane of its
/// first; a lane then joins, from the left, those of the bits of its number.
void IterationWriter::writeScan(ScanOp scan) {
  int64_t count = *getConstantIntValue(loop.getUpperBound());
  Block &body = scan.getBody().front();
  auto selectFrom = [&](auto from) {
    SmallVector<int64_t> lanes;
    for (int64_t lane = 0; lane < laneCount; ++lane)
      lanes.push_back(from(lane));
    return lanes;
  };
  SmallVector<SmallVector<Value>> blocks{getAll(scan.getValues())};
  for (int64_t size = 1; 2 * size < count; size *= 2) {
    SmallVector<Value> &left = blocks.back();
    SmallVector<Value> right =
        shuffle(left, selectFrom([&](int64_t lane) {
                  return std::min(lane + size, laneCount - 1);
                }));
    blocks.push_back(combine(body, left, right));
  }
  SmallVector<Value> before = getAll(scan.getEmpty());
  for (int64_t k = int64_t(blocks.size()) - 1; k >= 0; --k) {
    int64_t size = int64_t(1) << k;
    SmallVector<Value> block = shuffle(blocks[k], selectFrom([&](int64_t lane) {
                                         return lane & ~(2 * size - 1);
                                       }));
    Value begins = createMask(
        [&](int64_t lane) { return (lane & size) != 0 && lane < 2 * size; });
    Value joins = createMask(
        [&](int64_t lane) { return (lane & size) != 0 && lane >= 2 * size; });
    SmallVector<Value> joined = combine(body, before, block);
    for (auto [value, one, more] : llvm::zip(before, block, joined))
      value = choose(begins, one, choose(joins, more, value));
  }
  for (auto [from, to] : llvm::zip(scan.getResults(), before))
    vectors.map(from, to);
}

/// A lane counts the keys that come before its own; lane r then finds the one
/// that has counted r.
void IterationWriter::writeSort(SortOp sort) {
  int64_t count = *getConstantIntValue(loop.getUpperBound());
  CodeBuilder at(builder, loc);
  Value key = get(sort.getKey()), rank = number(0), index = number(0);
  auto ofLane = [&](Value value, int64_t lane) {
    return splat(vector::ExtractOp::create(builder, loc, value, lane));
  };
  for (int64_t lane = 0; lane < count; ++lane) {
    Value other = ofLane(key, lane);
    Value less = createLess(builder, loc, other, key, sort.getIsUnsigned());
    Value more = createLess(builder, loc, key, other, sort.getIsUnsigned());
    Value isAfter = createMask([&](int64_t own) { return own > lane; });
    Value ahead = at.either(less, choose(more, zeros(more.getType()), isAfter));
    rank = choose(ahead, at.add(rank, number(1)), rank);
  }
  Value own = arith::IndexCastOp::create(
      builder, loc, getVectorType(builder.getI32Type()),
      vector::StepOp::create(builder, loc,
                             getVectorType(builder.getIndexType())));
  for (int64_t lane = 0; lane < count; ++lane) {
    Value isIt = at.compare(CodeBuilder::P::eq, own, ofLane(rank, lane));
    index = choose(isIt, number(lane), index);
  }
  vectors.map(sort.getIndex(),
              arith::IndexCastOp::create(
                  builder, loc, getVectorType(builder.getIndexType()), index));
}

void IterationWriter::writeBarrier(Operation *op) {
  if (auto reduce = dyn_cast<ReduceOp>(op))
    writeReduce(reduce);
  else if (auto scan = dyn_cast<ScanOp>(op))
    writeScan(scan);
  else if (auto sort = dyn_cast<SortOp>(op))
    writeSort(sort);
}
