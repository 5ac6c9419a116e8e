// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is affine in the pixel, and the range of such functions over a box.

#include "Narrowing/AffineNest.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

static bool isStepOne(scf::ForOp loop) {
  return matchPattern(loop.getStep(), m_One());
}

AffineNest::AffineNest(scf::ForOp row)
    : builder(row), loc(row.getLoc()), row(row), outer(row) {
  auto parent = dyn_cast<scf::ForOp>(row->getParentOp());
  bool isRectangle = parent && isStepOne(parent) &&
                     parent.isDefinedOutsideOfLoop(row.getLowerBound()) &&
                     parent.isDefinedOutsideOfLoop(row.getUpperBound()) &&
                     !parent->hasAttr(marks::mapping);
  if (isRectangle) {
    outer = parent;
    loops.push_back(parent);
  }
  loops.push_back(row);
  builder.setInsertionPoint(outer);
}

/// What an argument that a loop carries grows by in each iteration, or null.
static Value getIncrement(BlockArgument argument, scf::ForOp loop) {
  auto add = loop.getTiedLoopYieldedValue(argument)
                 ->get()
                 .getDefiningOp<arith::AddIOp>();
  if (!add || (add.getLhs() != argument && add.getRhs() != argument))
    return {};
  return add.getLhs() == argument ? add.getRhs() : add.getLhs();
}

/// Whether an operation is -1 - x.
static bool isComplement(Operation *op) {
  APInt bits;
  return isa<arith::XOrIOp>(op) &&
         matchPattern(op->getOperand(1), m_ConstantInt(&bits)) &&
         bits.isAllOnes();
}

bool AffineNest::isAffine(Value value) {
  if (auto known = affine.find(value); known != affine.end())
    return known->second;
  bool result = computeIsAffine(value);
  affine[value] = result;
  return result;
}

bool AffineNest::isVariable(Value value) {
  return llvm::any_of(
      loops, [&](scf::ForOp loop) { return loop.getInductionVar() == value; });
}

bool AffineNest::computeIsAffine(Value value) {
  if (!value.getType().isInteger(64) && !value.getType().isInteger(32))
    return false;
  if (isInvariant(value) || isVariable(value))
    return true;
  if (auto argument = dyn_cast<BlockArgument>(value)) {
    auto loop = dyn_cast<scf::ForOp>(argument.getOwner()->getParentOp());
    if (!loop || !llvm::is_contained(loops, loop))
      return false;
    Value increment = getIncrement(argument, loop);
    return increment && isInvariant(increment) &&
           isAffine(loop.getTiedLoopInit(argument)->get());
  }
  Operation *op = value.getDefiningOp();
  if (isa<arith::ExtSIOp>(op))
    return isAffine(op->getOperand(0));
  if (isa<arith::IndexCastOp>(op))
    return value.getType().isInteger(64) && isVariable(op->getOperand(0));
  if (isa<arith::AddIOp, arith::SubIOp>(op))
    return isAffine(op->getOperand(0)) && isAffine(op->getOperand(1));
  if (isComplement(op))
    return isAffine(op->getOperand(0));
  if (isa<arith::MulIOp>(op))
    return (isAffine(op->getOperand(0)) && isInvariant(op->getOperand(1))) ||
           (isAffine(op->getOperand(1)) && isInvariant(op->getOperand(0)));
  if (isa<arith::ShLIOp>(op))
    return isAffine(op->getOperand(0)) &&
           matchPattern(op->getOperand(1), m_Constant());
  return matchPattern(value, m_Constant());
}

Value AffineNest::makeConstant(int64_t value) {
  return arith::ConstantIntOp::create(builder, loc, value, 64);
}

Value AffineNest::getTwo(bool isSum, Value a, Value b) {
  if (!b)
    return a;
  if (!a && isSum)
    return b;
  if (!a)
    a = makeConstant(0);
  return isSum ? arith::AddIOp::create(builder, loc, a, b).getResult()
               : arith::SubIOp::create(builder, loc, a, b).getResult();
}

Affine AffineNest::subtract(Affine a, const Affine &b) {
  a.base = getTwo(false, a.base, b.base);
  for (auto [x, y] : llvm::zip(a.coefficients, b.coefficients))
    x = getTwo(false, x, y);
  return a;
}

Value AffineNest::extend(Value number) {
  Type wide = builder.getI64Type();
  if (number.getType().isIndex())
    return arith::IndexCastOp::create(builder, loc, wide, number);
  if (number.getType() != wide)
    return arith::ExtSIOp::create(builder, loc, wide, number);
  return number;
}

/// Of a variable that grows by one: what it is at the first iteration is its
/// value less that of the induction variable there, which counts from another
/// number.
Affine AffineNest::expandArgument(BlockArgument argument) {
  auto loop = cast<scf::ForOp>(argument.getOwner()->getParentOp());
  unsigned number = loop == loops.front() ? 0 : 1;
  Affine result;
  if (argument == loop.getInductionVar()) {
    result.coefficients[number] = makeConstant(1);
    return result;
  }
  Value increment = extend(getIncrement(argument, loop));
  Value lower = extend(loop.getLowerBound());
  result = expand(loop.getTiedLoopInit(argument)->get());
  result.base = getTwo(false, result.base,
                       arith::MulIOp::create(builder, loc, increment, lower));
  result.coefficients[number] =
      getTwo(true, result.coefficients[number], increment);
  return result;
}

Affine AffineNest::expand(Value value) {
  if (auto known = expanded.find(value); known != expanded.end())
    return known->second;
  Affine result = computeExpansion(value);
  expanded[value] = result;
  return result;
}

Affine AffineNest::computeExpansion(Value value) {
  if (isInvariant(value))
    return {extend(value), {}};
  if (auto argument = dyn_cast<BlockArgument>(value))
    return expandArgument(argument);
  Operation *op = value.getDefiningOp();
  if (isa<arith::ExtSIOp, arith::IndexCastOp>(op)) {
    Value number = op->getOperand(0);
    if (isVariable(number))
      return expandArgument(cast<BlockArgument>(number));
    Affine narrow = expand(number);
    assumed.push_back(narrow);
    return narrow;
  }
  if (matchPattern(value, m_Constant()))
    return {extend(builder.clone(*op)->getResult(0)), {}};
  if (isa<arith::AddIOp, arith::SubIOp>(op)) {
    bool isSum = isa<arith::AddIOp>(op);
    Affine a = expand(op->getOperand(0)), b = expand(op->getOperand(1));
    a.base = getTwo(isSum, a.base, b.base);
    for (auto [x, y] : llvm::zip(a.coefficients, b.coefficients))
      x = getTwo(isSum, x, y);
    return a;
  }
  if (isComplement(op)) {
    Affine a = expand(op->getOperand(0));
    Value ones = makeConstant(-1);
    a.base = getTwo(false, ones, a.base);
    for (Value &x : a.coefficients)
      x = getTwo(false, Value(), x);
    return a;
  }
  bool isFirst = isa<arith::ShLIOp>(op) || isInvariant(op->getOperand(1));
  Affine a = expand(op->getOperand(isFirst ? 0 : 1));
  Value factor = op->getOperand(isFirst ? 1 : 0);
  if (!isInvariant(factor))
    factor = builder.clone(*factor.getDefiningOp())->getResult(0);
  factor = extend(factor);
  auto scale = [&](Value &x) {
    if (!x)
      return;
    if (isa<arith::ShLIOp>(op))
      x = arith::ShLIOp::create(builder, loc, x, factor);
    else if (matchPattern(x, m_One()))
      x = factor;
    else
      x = arith::MulIOp::create(builder, loc, x, factor);
  };
  scale(a.base);
  for (Value &x : a.coefficients)
    scale(x);
  return a;
}

/// How many of the lowest bits of a value are known to be 0, from what is not
/// too far away.
static unsigned countZeros(Value value, unsigned depth = 8) {
  APInt number;
  if (matchPattern(value, m_ConstantInt(&number)))
    return number.isZero() ? 32 : std::min(32u, number.countr_zero());
  Operation *op = value.getDefiningOp();
  if (!op || depth == 0)
    return 0;
  auto count = [&](unsigned i) {
    return countZeros(op->getOperand(i), depth - 1);
  };
  if (isa<arith::AddIOp, arith::SubIOp>(op))
    return std::min(count(0), count(1));
  if (isa<arith::MulIOp>(op))
    return std::min(32u, count(0) + count(1));
  if (isa<arith::ShLIOp>(op) &&
      matchPattern(op->getOperand(1), m_ConstantInt(&number)))
    return std::min<uint64_t>(32, count(0) + number.getLimitedValue(32));
  if (isa<arith::ExtSIOp>(op))
    return count(0);
  return 0;
}

unsigned AffineNest::shiftDown(Affine &affine) {
  unsigned zeros = 24;
  for (Value coefficient : affine.coefficients)
    if (coefficient)
      zeros = std::min(zeros, countZeros(coefficient));
  if (zeros == 0)
    return 0;
  Value by = makeConstant(zeros);
  auto shift = [&](Value &value) {
    if (value)
      value = arith::ShRSIOp::create(builder, loc, value, by);
  };
  shift(affine.base);
  for (Value &coefficient : affine.coefficients)
    shift(coefficient);
  return zeros;
}

void AffineNest::require(Value value, int bits, Value &fits) {
  // As unsigned, so that one comparison is enough.
  Value moved = arith::AddIOp::create(builder, loc, value,
                                      makeConstant(1ll << (bits - 1)));
  Value isIn = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ult,
                                     moved, makeConstant(1ll << bits));
  fits =
      fits ? arith::AndIOp::create(builder, loc, fits, isIn).getResult() : isIn;
}

// A base of 62 bits, steps of 32 and variables of 28 make what is computed
// here, so that nothing of it overflows.
AffineNest::Range AffineNest::addCheck(const Affine &affine, Value &fits) {
  for (const Affine &narrow : std::exchange(assumed, {}))
    addCheck(narrow, fits);
  Value least = affine.base ? affine.base : makeConstant(0);
  require(least, 62, fits);
  Value most = least;
  for (auto [loop, step] : llvm::zip(loops, affine.coefficients)) {
    if (!step)
      continue;
    require(step, 32, fits);
    Value first = extend(loop.getLowerBound()),
          end = extend(loop.getUpperBound());
    require(first, 28, fits);
    require(end, 28, fits);
    Value last = arith::SubIOp::create(builder, loc, end, makeConstant(1));
    Value atFirst = arith::MulIOp::create(builder, loc, step, first),
          atLast = arith::MulIOp::create(builder, loc, step, last);
    least = arith::AddIOp::create(
        builder, loc, least,
        arith::MinSIOp::create(builder, loc, atFirst, atLast));
    most = arith::AddIOp::create(
        builder, loc, most,
        arith::MaxSIOp::create(builder, loc, atFirst, atLast));
  }
  require(least, 32, fits);
  if (most != least)
    require(most, 32, fits);
  return {least, most};
}
