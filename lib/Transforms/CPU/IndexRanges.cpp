// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "CPU/IndexRanges.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

//===----------------------------------------------------------------------===//
// Counts
//===----------------------------------------------------------------------===//

/// Whether a loop that counts up by one goes on while it is less than a number
/// that it does not change.
static bool isLess(const CountedLoop::Bound &bound, Value first) {
  if (bound.predicate == Predicate::slt)
    return true;
  // From a number that is known to one that is not below it, as signed ones.
  APInt least, greatest;
  if (!matchPattern(first, m_ConstantInt(&least)) ||
      !matchPattern(bound.end, m_ConstantInt(&greatest)) || least.sgt(greatest))
    return false;
  return bound.predicate == Predicate::ne ||
         (bound.predicate == Predicate::ult && least.isNonNegative());
}

std::optional<LoopCount> piko::findLoopCount(LoopLikeOpInterface loop) {
  std::optional<CountedLoop> counted = findCountedLoop(loop);
  const CountedLoop::Bound *bound = counted ? counted->getBound() : nullptr;
  if (!bound || !counted->isByOne() || !isLess(*bound, counted->first))
    return {};
  return LoopCount{counted->counter, counted->first, bound->end};
}

//===----------------------------------------------------------------------===//
// Ranges
//===----------------------------------------------------------------------===//

IndexRanges::IndexRanges(LoopLikeOpInterface root, OpBuilder &builder)
    : root(root), builder(builder), loc(root.getLoc()) {
  root->walk([&](LoopLikeOpInterface loop) {
    if (std::optional<LoopCount> count = findLoopCount(loop))
      counts[count->value] = *count;
  });
}

Value IndexRanges::constant(int64_t value) {
  return arith::ConstantIndexOp::create(builder, loc, value);
}

void IndexRanges::expect(Predicate predicate, Value a, Value b) {
  Value holds = builder.createOrFold<arith::CmpIOp>(loc, predicate, a, b);
  test = test ? create<arith::AndIOp>(test, holds) : holds;
}

void IndexRanges::expectInside(Range range, FlatSymbolRefAttr state,
                               int64_t dim) {
  expect(Predicate::sge, range.least, constant(0));
  expect(Predicate::slt, range.greatest,
         ExtentOp::create(builder, loc, state.getAttr(), dim));
}

IndexRanges::Range IndexRanges::getUnion(Range a, Range b) {
  return {create<arith::MinSIOp>(a.least, b.least),
          create<arith::MaxSIOp>(a.greatest, b.greatest)};
}

IndexRanges::Range IndexRanges::multiply(Range a, Range b) {
  auto times = [&](Value x, Range y) {
    Value p = create<arith::MulIOp>(x, y.least);
    if (y.least == y.greatest)
      return Range{p, p};
    Value q = create<arith::MulIOp>(x, y.greatest);
    return getUnion({p, p}, {q, q});
  };
  Range product = times(a.least, b);
  return a.least == a.greatest ? product
                               : getUnion(product, times(a.greatest, b));
}

/// A number of the code around the loops.
IndexRanges::Range IndexRanges::getLeaf(Value value) {
  Value index = value;
  if (!value.getType().isIndex())
    index = builder.createOrFold<arith::IndexCastOp>(
        loc, builder.getIndexType(), value);
  return {index, index};
}

std::optional<IndexRanges::Range>
IndexRanges::findOfRemainder(Value lhs, Value rhs, bool isSigned) {
  std::optional<Range> divisor = get(rhs);
  if (!divisor)
    return {};
  if (isSigned) {
    std::optional<Range> dividend = get(lhs);
    if (!dividend)
      return {};
    expect(Predicate::sge, dividend->least, constant(0));
  }
  expect(Predicate::sge, divisor->least, constant(1));
  return Range{constant(0),
               create<arith::SubIOp>(divisor->greatest, constant(1))};
}

std::optional<IndexRanges::Range>
IndexRanges::findOfDivision(DivideOp division) {
  if (division.getKind() == DivisionKind::RemainderS ||
      division.getKind() == DivisionKind::RemainderU)
    return findOfRemainder(division.getLhs(), division.getRhs(),
                           division.isSigned());
  return {};
}

/// Of what grows with the number, by a positive constant: shifts and quotients;
/// and of a number whose upper bits are left out.
std::optional<IndexRanges::Range> IndexRanges::findByConstant(Operation *op,
                                                              int64_t number) {
  bool isShift = isa<arith::ShLIOp, arith::ShRSIOp, arith::ShRUIOp>(op);
  constexpr int64_t mostBits = 31;
  if (number < 0 || (isShift && number > mostBits) || (!isShift && number == 0))
    return {};
  if (isa<arith::AndIOp>(op))
    return Range{constant(0), constant(number)};
  std::optional<Range> range = get(op->getOperand(0));
  if (!range)
    return {};
  if (isa<arith::DivUIOp, arith::ShRUIOp>(op))
    expect(Predicate::sge, range->least, constant(0));
  Value by = constant(isShift ? int64_t(1) << number : number);
  if (isa<arith::ShLIOp>(op))
    return multiply(*range, {by, by});
  // A shift rounds down.
  auto divide = [&](Value value) -> Value {
    return isa<arith::ShRSIOp>(op)
               ? create<arith::ShRSIOp>(value, constant(number))
               : create<arith::DivSIOp>(value, by);
  };
  return Range{divide(range->least), divide(range->greatest)};
}

std::optional<IndexRanges::Range> IndexRanges::findOfOperation(Operation *op) {
  if (APInt number; isa<arith::AndIOp, arith::DivSIOp, arith::DivUIOp,
                        arith::ShLIOp, arith::ShRSIOp, arith::ShRUIOp>(op) &&
                    matchPattern(op->getOperand(1), m_ConstantInt(&number)) &&
                    number.isSignedIntN(32))
    return findByConstant(op, number.getSExtValue());
  if (auto division = dyn_cast<DivideOp>(op))
    return findOfDivision(division);
  if (isa<arith::RemSIOp, arith::RemUIOp>(op))
    return findOfRemainder(op->getOperand(0), op->getOperand(1),
                           isa<arith::RemSIOp>(op));
  if (isa<arith::ExtSIOp, arith::IndexCastOp, arith::TruncIOp>(op))
    return get(op->getOperand(0));
  if (isa<arith::ExtUIOp>(op)) {
    unsigned bits = op->getOperand(0).getType().getIntOrFloatBitWidth();
    constexpr unsigned few = 16;
    if (bits <= few)
      return Range{constant(0), constant((int64_t(1) << bits) - 1)};
    std::optional<Range> range = get(op->getOperand(0));
    if (range)
      expect(Predicate::sge, range->least, constant(0));
    return range;
  }
  if (auto choice = dyn_cast<arith::SelectOp>(op)) {
    std::optional<Range> yes = get(choice.getTrueValue()),
                         no = get(choice.getFalseValue());
    return yes && no ? getUnion(*yes, *no) : std::optional<Range>();
  }
  if (!isa<arith::AddIOp, arith::SubIOp, arith::MulIOp, arith::MinSIOp,
           arith::MaxSIOp, arith::OrIOp>(op))
    return {};
  std::optional<Range> a = get(op->getOperand(0)), b = get(op->getOperand(1));
  if (!a || !b)
    return {};
  if (isa<arith::MulIOp>(op))
    return multiply(*a, *b);
  if (isa<arith::AddIOp>(op))
    return Range{create<arith::AddIOp>(a->least, b->least),
                 create<arith::AddIOp>(a->greatest, b->greatest)};
  if (isa<arith::OrIOp>(op)) { // of bits that differ, as a rule: a sum
    expect(Predicate::sge, a->least, constant(0));
    expect(Predicate::sge, b->least, constant(0));
    return Range{create<arith::MaxSIOp>(a->least, b->least),
                 create<arith::AddIOp>(a->greatest, b->greatest)};
  }
  if (isa<arith::SubIOp>(op))
    return Range{create<arith::SubIOp>(a->least, b->greatest),
                 create<arith::SubIOp>(a->greatest, b->least)};
  if (isa<arith::MinSIOp>(op))
    return Range{create<arith::MinSIOp>(a->least, b->least),
                 create<arith::MinSIOp>(a->greatest, b->greatest)};
  return Range{create<arith::MaxSIOp>(a->least, b->least),
               create<arith::MaxSIOp>(a->greatest, b->greatest)};
}

std::optional<IndexRanges::Range> IndexRanges::find(Value value) {
  APInt number;
  if (matchPattern(value, m_ConstantInt(&number)) && number.isSignedIntN(32)) {
    Value at = constant(number.getSExtValue());
    return Range{at, at};
  }
  if (root.isDefinedOutsideOfLoop(value))
    return getLeaf(value);
  if (auto found = counts.find(value); found != counts.end()) {
    std::optional<Range> first = get(found->second.first),
                         end = get(found->second.end);
    if (!first || !end)
      return {};
    return Range{first->least,
                 create<arith::SubIOp>(end->greatest, constant(1))};
  }
  Operation *op = value.getDefiningOp();
  return op ? findOfOperation(op) : std::optional<Range>();
}

std::optional<IndexRanges::Range> IndexRanges::get(Value value) {
  if (!value.getType().isIntOrIndex())
    return {};
  if (auto found = known.find(value); found != known.end())
    return found->second;
  std::optional<Range> range = find(value);
  constexpr int64_t limit = int64_t(1) << 31;
  constexpr unsigned narrow = 16;
  bool isNarrow = value.getType().isInteger() &&
                  value.getType().getIntOrFloatBitWidth() <= narrow;
  bool isNumber =
      root.isDefinedOutsideOfLoop(value) && value.getType().isInteger(32);
  if (isNarrow)
    range = {}; // wraps around at other numbers
  if (range && !isNumber && !matchPattern(value, m_Constant())) {
    expect(Predicate::sge, range->least, constant(-limit));
    expect(Predicate::slt, range->greatest, constant(limit));
  }
  known[value] = range;
  return range;
}
