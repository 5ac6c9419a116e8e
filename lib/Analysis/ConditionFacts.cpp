//===- ConditionFacts.cpp - What a condition says -------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Analysis/LinearFacts.h"

#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;
using Predicate = arith::CmpIPredicate;

/// That both of two facts hold, or one of them.
static LinearFact combine(bool both, LinearFact a, LinearFact b) {
  if (both) {
    a.add(std::move(b));
    return a;
  }
  LinearFact either;
  either.choices.push_back({std::move(a), std::move(b)});
  return either;
}

LinearFact ConditionFacts::describeUnknown(Value condition, bool truth,
                                           unsigned frame) {
  auto [found, isNew] = truths.try_emplace(core.number(condition, frame));
  if (isNew) {
    found->second = core.system.addVariable();
    core.system.getFacts().addBetween(Linear(0), found->second, Linear(1));
  }
  LinearFact fact;
  fact.addZero(found->second - Linear(truth ? 1 : 0));
  return fact;
}

LinearFact ConditionFacts::describeChoice(Value condition, Value ifTrue,
                                          Value ifFalse, bool truth,
                                          unsigned frame) {
  LinearFact either;
  std::vector<LinearFact> cases;
  for (bool chosen : {true, false}) {
    LinearFact fact = describe(condition, chosen, frame);
    if (Value value = chosen ? ifTrue : ifFalse) {
      // What holds of what an arm computes holds only if it runs.
      LinearFact computed;
      LinearFact *outer = std::exchange(core.facts, &computed);
      LinearFact said = describe(value, truth, frame);
      core.facts = outer;
      fact.add(std::move(computed));
      fact.add(std::move(said));
    }
    cases.push_back(std::move(fact));
  }
  either.choices.push_back(std::move(cases));
  return either;
}

std::optional<LinearFact>
ConditionFacts::describeFlow(Value condition, bool truth, unsigned frame) {
  if (auto argument = dyn_cast<BlockArgument>(condition)) {
    auto loop = dyn_cast<scf::WhileOp>(argument.getOwner()->getParentOp());
    if (!loop || argument.getOwner() != loop.getAfterBody())
      return std::nullopt;
    return describe(loop.getConditionOp().getArgs()[argument.getArgNumber()],
                    truth, frame);
  }
  unsigned result = cast<OpResult>(condition).getResultNumber();
  if (auto choice = condition.getDefiningOp<scf::IfOp>()) {
    auto known = [&](scf::YieldOp yield) {
      Value value = yield.getOperand(result);
      return value.getDefiningOp<ub::PoisonOp>() ? Value() : value;
    };
    for (scf::YieldOp yield : {choice.thenYield(), choice.elseYield()})
      core.expandAhead(choice, yield.getOperand(result), frame);
    return describeChoice(choice.getCondition(), known(choice.thenYield()),
                          known(choice.elseYield()), truth, frame);
  }
  if (auto loop = condition.getDefiningOp<scf::WhileOp>()) {
    // As it was when the loop ended.
    scf::ConditionOp end = loop.getConditionOp();
    core.assume(end.getCondition(), false, frame);
    return describe(end.getArgs()[result], truth, frame);
  }
  return std::nullopt;
}

LinearFact ConditionFacts::describeEqual(Value a, Value b, bool isEqual,
                                         unsigned frame) {
  auto both = [&](bool first) {
    return combine(true, describe(a, first, frame),
                   describe(b, first == isEqual, frame));
  };
  return combine(false, both(true), both(false));
}

LinearFact ConditionFacts::describe(Value condition, bool truth,
                                    unsigned frame) {
  if (APInt constant; matchPattern(condition, m_ConstantInt(&constant))) {
    LinearFact fact;
    if (constant.isOne() != truth)
      fact.addContradiction();
    return fact;
  }
  Operation *op = condition.getDefiningOp();
  auto of = [&](unsigned operand, bool is) {
    return describe(op->getOperand(operand), is, frame);
  };
  if (isa_and_nonnull<arith::AndIOp, arith::OrIOp>(op))
    return combine(isa<arith::AndIOp>(op) == truth, of(0, truth), of(1, truth));
  if (isa_and_nonnull<arith::XOrIOp>(op) &&
      matchPattern(op->getOperand(1), m_One()))
    return of(0, !truth);
  if (isa_and_nonnull<arith::XOrIOp>(op))
    return describeEqual(op->getOperand(0), op->getOperand(1), !truth, frame);
  if (auto low = dyn_cast_or_null<arith::TruncIOp>(op)) {
    // A bool in memory is 0 or 1.
    Linear byte = core.get(low.getIn(), frame);
    if (!core.isSurelyAtLeastZero(byte) ||
        !core.isSurelyAtLeastZero(Linear(1) - byte))
      return describeUnknown(condition, truth, frame);
    LinearFact fact;
    fact.addZero(byte - Linear(truth ? 1 : 0));
    return fact;
  }
  if (auto select = dyn_cast_or_null<arith::SelectOp>(op);
      select && select.getType().isInteger(1))
    return combine(false, combine(true, of(0, true), of(1, truth)),
                   combine(true, of(0, false), of(2, truth)));
  if (auto compare = dyn_cast_or_null<arith::CmpIOp>(op))
    return describeInteger(compare, truth, frame);
  if (auto compare = dyn_cast_or_null<arith::CmpFOp>(op))
    return core.floats.describeFloat(compare, truth, frame);
  if (std::optional<LinearFact> fact = describeFlow(condition, truth, frame))
    return *fact;
  return describeUnknown(condition, truth, frame);
}

BinAtOp ConditionFacts::getComparedCell(arith::CmpIOp compare, unsigned frame) {
  // The number of a bin may not fit in fewer bits.
  auto strip = [](Value value) {
    auto isWide = [](Type type) {
      return type.isIndex() || type.isInteger(64);
    };
    while (auto cast = value.getDefiningOp<arith::IndexCastOp>()) {
      if (!isWide(cast.getType()) || !isWide(cast.getIn().getType()))
        break;
      value = cast.getIn();
    }
    return value;
  };
  Value a = strip(compare.getLhs()), b = strip(compare.getRhs());
  if (core.bin.isOwnBin(a, frame))
    std::swap(a, b);
  return core.bin.isOwnBin(b, frame) ? a.getDefiningOp<BinAtOp>() : BinAtOp();
}

/// That `a < b`, or that it is not, as unsigned numbers.
static LinearFact describeBelow(const Linear &a, const Linear &b, bool truth) {
  LinearFact fact;
  if (truth) {
    fact.addBetween(Linear(0), a, b - Linear(1));
    return fact;
  }
  LinearFact negative, notBelow;
  negative.addAtLeastZero(Linear(-1) - a);
  notBelow.addAtLeastZero(a - b);
  fact.choices.push_back({negative, notBelow});
  return fact;
}

LinearFact ConditionFacts::describeInteger(arith::CmpIOp compare, bool truth,
                                           unsigned frame) {
  Predicate predicate = compare.getPredicate();
  bool isEqual = (predicate == Predicate::eq) == truth;
  if (compare.getLhs().getType().isInteger(1))
    return predicate == Predicate::eq || predicate == Predicate::ne
               ? describeEqual(compare.getLhs(), compare.getRhs(), isEqual,
                               frame)
               : describeUnknown(compare, truth, frame);
  if (predicate == Predicate::eq || predicate == Predicate::ne)
    if (BinAtOp cell = getComparedCell(compare, frame))
      return isEqual ? core.bin.describeInBin(cell, frame)
                     : describeUnknown(compare, truth, frame);
  Linear a = core.get(compare.getLhs(), frame),
         b = core.get(compare.getRhs(), frame);
  LinearFact fact;
  switch (predicate) {
  case Predicate::eq:
  case Predicate::ne:
    if (isEqual) {
      fact.addZero(a - b);
    } else {
      LinearFact less, more;
      less.addAtLeastZero(b - a - Linear(1));
      more.addAtLeastZero(a - b - Linear(1));
      fact.choices.push_back({less, more});
    }
    return fact;
  case Predicate::sgt:
  case Predicate::sle:
    std::swap(a, b);
    [[fallthrough]];
  case Predicate::slt:
  case Predicate::sge: {
    bool isLess =
        (predicate == Predicate::slt || predicate == Predicate::sgt) == truth;
    fact.addAtLeastZero(isLess ? b - a - Linear(1) : a - b);
    return fact;
  }
  case Predicate::ugt:
  case Predicate::ule:
    std::swap(a, b);
    [[fallthrough]];
  case Predicate::ult:
  case Predicate::uge: {
    bool isLess =
        (predicate == Predicate::ult || predicate == Predicate::ugt) == truth;
    // As unsigned numbers they are what they are as signed ones, or more.
    return core.isSurelyAtLeastZero(b) ? describeBelow(a, b, isLess)
                                       : describeUnknown(compare, truth, frame);
  }
  }
  llvm_unreachable("all predicates are listed");
}
