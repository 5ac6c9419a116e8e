// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loop collapsing: vectors are filled with pairs of a lane and an iteration of
// its inner loops, by a scan over how many iterations each lane makes, so that
// pixels of small boxes leave few lanes idle. Where a lane makes more than
// 1,024 iterations of one loop, lanes go through the loops in step.

#include "Vectorize/Write/IterationWriter.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/TypeUtilities.h"

using namespace mlir;
using namespace piko;

/// With more iterations of a loop the quotient of two floats would not be
/// exact: it is less than 2^10, of numbers below 2^20, so that two rounding
/// errors are less than 2^-13, and it is at least 2^-11 away from an integer.
static constexpr int64_t mostTurns = 1024;

/// Which lane's turns a place is among, by where the lanes' turns end: how many
/// of them end before it. With few lanes each is asked, and with more by binary
/// search.
Value IterationWriter::findLane(Value ends, Value place) {
  CodeBuilder at(builder, loc);
  using P = CodeBuilder::P;
  Value lane = number(0), one = number(1);
  constexpr int64_t few = 4;
  if (laneCount > few) {
    for (int64_t step = laneCount / 2; step > 0; step /= 2) {
      Value next = at.add(lane, number(step));
      Value end = permute(ends, at.sub(next, one));
      lane = choose(at.compare(P::sle, end, place), next, lane);
    }
    return lane;
  }
  // The last one ends after all places that count.
  for (int64_t i = 0; i + 1 < laneCount; ++i) {
    Value end = splat(vector::ExtractOp::create(builder, loc, ends, i));
    lane = choose(at.compare(P::sle, end, place), at.add(lane, one), lane);
  }
  return lane;
}

Value IterationWriter::countTurns(scf::ForOp inner) {
  auto widen = [&](Value bound) {
    return lanes.isVarying(bound) ? get(bound) : splat(getUniform(bound));
  };
  CodeBuilder at(builder, loc);
  Value lower = widen(inner.getLowerBound()),
        upper = widen(inner.getUpperBound());
  Value some = at.compare(CodeBuilder::P::slt, lower, upper);
  Value count = at.sub(upper, lower);
  // Far too many stay far too many.
  auto words = getVectorType(builder.getI32Type());
  Type element = cast<VectorType>(count.getType()).getElementType();
  if (!element.isInteger(32)) {
    Value most = arith::ConstantOp::create(
        builder, loc,
        DenseElementsAttr::get(cast<ShapedType>(count.getType()),
                               builder.getIntegerAttr(element, mostTurns + 1)));
    count = arith::MinUIOp::create(builder, loc, count, most);
    count =
        element.isIndex()
            ? arith::IndexCastOp::create(builder, loc, words, count).getResult()
            : arith::TruncIOp::create(builder, loc, words, count).getResult();
  }
  return choose(both(active, some), count, number(0));
}

/// Sums of the numbers up to each lane.
static Value scan(OpBuilder &builder, Location loc, Value numbers) {
  Value zero = arith::ConstantOp::create(
      builder, loc, builder.getZeroAttr(numbers.getType()));
  int64_t laneCount = cast<VectorType>(numbers.getType()).getNumElements();
  for (int64_t distance = 1; distance < laneCount; distance *= 2) {
    SmallVector<int64_t> from;
    for (int64_t lane = 0; lane < laneCount; ++lane)
      from.push_back(lane < distance ? laneCount : lane - distance);
    Value moved = vector::ShuffleOp::create(builder, loc, numbers, zero, from);
    numbers = arith::AddIOp::create(builder, loc, numbers, moved);
  }
  return numbers;
}

/// What a nest takes from outside that differs between lanes.
static llvm::SetVector<Value> findInputs(scf::ForOp nest,
                                         const IterationLanes &lanes) {
  llvm::SetVector<Value> inputs;
  nest.walk([&](Operation *op) {
    for (Value operand : op->getOperands())
      if (lanes.isVarying(operand) &&
          !nest->isAncestor(operand.getParentBlock()->getParentOp()))
        inputs.insert(operand);
  });
  return inputs;
}

void IterationWriter::writePairs(ArrayRef<scf::ForOp> nest,
                                 ArrayRef<Value> counts) {
  CodeBuilder at(builder, loc);
  using P = CodeBuilder::P;
  auto words = getVectorType(builder.getI32Type());
  Value count = counts.front();
  for (Value inner : counts.drop_front())
    count = at.mul(count, inner);
  Value ends = scan(builder, loc, count), starts = at.sub(ends, count);
  Value total = vector::ExtractOp::create(builder, loc, ends, laneCount - 1);
  // There is one division for all pairs.
  auto floats = getVectorType(builder.getF32Type());
  auto constant = [&](float value) {
    return splat(arith::ConstantOp::create(builder, loc,
                                           builder.getF32FloatAttr(value)));
  };
  Value part;
  if (nest.size() == 2)
    part = arith::DivFOp::create(
        builder, loc, constant(1),
        arith::SIToFPOp::create(builder, loc, floats, counts[1]));
  auto made = scf::ForOp::create(
      builder, loc, at.index(0),
      arith::IndexCastOp::create(builder, loc, builder.getIndexType(), total),
      at.index(laneCount));
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(made.getBody());
  SmallVector<int32_t> steps =
      llvm::to_vector(llvm::seq<int32_t>(0, laneCount));
  Value first = arith::IndexCastOp::create(builder, loc, builder.getI32Type(),
                                           made.getInductionVar());
  Value place =
      at.add(vector::BroadcastOp::create(builder, loc, words, first),
             arith::ConstantOp::create(
                 builder, loc, DenseIntElementsAttr::get(words, steps)));
  IRMapping savedVectors(vectors), savedScalars(scalars), savedFirsts(firsts);
  Value outer = active;
  active = at.compare(P::slt, place,
                      vector::BroadcastOp::create(builder, loc, words, total));
  Value lane = findLane(ends, place);
  Value turn = at.sub(place, permute(starts, lane));
  for (Value value : findInputs(nest.front(), lanes))
    vectors.map(value, permute(get(value), lane));
  auto setVariable = [&](scf::ForOp loop, Value turns) {
    Value lower = get(loop.getLowerBound());
    Type type = lower.getType();
    if (type != words)
      turns =
          getElementTypeOrSelf(type).isIndex()
              ? arith::IndexCastOp::create(builder, loc, type, turns)
                    .getResult()
              : arith::ExtUIOp::create(builder, loc, type, turns).getResult();
    vectors.map(loop.getInductionVar(), at.add(lower, turns));
  };
  if (nest.size() == 2) {
    Value middle = arith::AddFOp::create(
        builder, loc, arith::SIToFPOp::create(builder, loc, floats, turn),
        constant(0.5));
    Value row = arith::FPToSIOp::create(
        builder, loc, words,
        arith::MulFOp::create(builder, loc, middle, permute(part, lane)));
    row = choose(active, row, number(0));
    setVariable(nest[0], row);
    turn = at.sub(turn, at.mul(row, permute(counts[1], lane)));
    setVariable(nest[1], turn);
    for (Operation &op : scf::ForOp(nest[0]).getBody()->without_terminator())
      if (&op != nest[1])
        writeOperation(&op);
  } else {
    setVariable(nest[0], turn);
  }
  bool wasPaired = std::exchange(paired, true);
  writeBlock(*scf::ForOp(nest.back()).getBody());
  paired = wasPaired;
  active = outer;
  vectors = savedVectors;
  scalars = savedScalars;
  firsts = savedFirsts;
}

void IterationWriter::writeNest(scf::ForOp loop) {
  SmallVector<scf::ForOp> nest = lanes.getNest(loop);
  SmallVector<Value> counts;
  CodeBuilder at(builder, loc);
  Value tooMany;
  for (scf::ForOp one : nest) {
    counts.push_back(countTurns(one));
    Value isMore =
        at.compare(CodeBuilder::P::ugt, counts.back(), number(mostTurns));
    tooMany = tooMany ? at.either(tooMany, isMore) : isMore;
  }
  auto choice = scf::IfOp::create(builder, loc, any(tooMany),
                                  /*withElseRegion=*/true);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(choice.elseBlock());
  writePairs(nest, counts);
  builder.setInsertionPointToStart(choice.thenBlock());
  IRMapping savedVectors(vectors), savedScalars(scalars), savedFirsts(firsts);
  writeVaryingFor(loop);
  vectors = savedVectors;
  scalars = savedScalars;
  firsts = savedFirsts;
}
