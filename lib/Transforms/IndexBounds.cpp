// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "IndexBounds.h"
#include "Induction.h"

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;
using Predicate = arith::CmpIPredicate;

static bool isConstant(Value value, llvm::function_ref<bool(const APInt &)> f) {
  APInt constant;
  return matchPattern(value, m_ConstantInt(&constant)) && f(constant);
}

static bool isNarrowing(arith::IndexCastOp cast) {
  return cast.getIn().getType().isIndex() && !cast.getType().isInteger(64);
}

/// Whether a value of type index is a number that an i32 has.
static bool fitsI32(Value value) {
  value = stripWidening(value);
  if (isa_and_nonnull<DomainOp, BinLoOp, BinHiOp>(value.getDefiningOp()) ||
      value.getType().isInteger(32) ||
      isConstant(value, [](const APInt &c) { return c.isSignedIntN(32); }))
    return true;
  // Iterations up to a count that an i32 has.
  auto argument = dyn_cast<BlockArgument>(value);
  auto loop = argument
                  ? dyn_cast<ParallelForOp>(argument.getOwner()->getParentOp())
                  : ParallelForOp();
  return loop && fitsI32(loop.getCount());
}

Value piko::stripWidening(Value value) {
  while (Operation *op = value.getDefiningOp()) {
    if (auto cast = dyn_cast<arith::IndexCastOp>(op)) {
      if (isNarrowing(cast) && !fitsI32(cast.getIn()))
        return value;
    } else if (!isa<arith::ExtSIOp>(op)) {
      return value;
    }
    value = op->getOperand(0);
  }
  return value;
}

/// The bound, or its low bits: a number that is at least 0 and less than these
/// is less than the bound.
bool IndexBounds::isBoundItself(Value value) {
  value = stripWidening(value);
  if (auto cast = value.getDefiningOp<arith::IndexCastOp>())
    value = stripWidening(cast.getIn());
  else if (auto truncation = value.getDefiningOp<arith::TruncIOp>())
    return isBoundItself(truncation.getIn());
  return isBound(value);
}

//===----------------------------------------------------------------------===//
// Conditions
//===----------------------------------------------------------------------===//

static Predicate swap(Predicate predicate) {
  switch (predicate) {
  case Predicate::slt:
    return Predicate::sgt;
  case Predicate::sle:
    return Predicate::sge;
  case Predicate::sgt:
    return Predicate::slt;
  case Predicate::sge:
    return Predicate::sle;
  case Predicate::ult:
    return Predicate::ugt;
  case Predicate::ule:
    return Predicate::uge;
  case Predicate::ugt:
    return Predicate::ult;
  case Predicate::uge:
    return Predicate::ule;
  default:
    return predicate;
  }
}

/// What `value PREDICATE right` says about the value.
bool IndexBounds::holds(Predicate predicate, Value right, bool below) {
  if (predicate == Predicate::ult || predicate == Predicate::eq)
    return below
               ? (predicate == Predicate::eq ? isBelow(right) : isAtMost(right))
               : isNonNegative(right);
  if (below)
    return (predicate == Predicate::slt && isAtMost(right)) ||
           (predicate == Predicate::sle && isBelow(right));
  if (predicate == Predicate::sgt)
    return isConstant(right, [](const APInt &c) { return c.isAllOnes(); }) ||
           isNonNegative(right);
  return predicate == Predicate::sge && isNonNegative(right);
}

bool IndexBounds::holds(Value condition, bool truth, Value value, bool below) {
  Operation *op = condition.getDefiningOp();
  if (!op)
    return false;
  auto either = [&](Value a, Value b) {
    return holds(a, truth, value, below) || holds(b, truth, value, below);
  };
  // `a && b` holds, or `a || b` does not; as operations, or as choices.
  if (truth ? isa<arith::AndIOp>(op) : isa<arith::OrIOp>(op))
    return either(op->getOperand(0), op->getOperand(1));
  if (auto select = dyn_cast<arith::SelectOp>(op)) {
    Value other = truth ? select.getFalseValue() : select.getTrueValue();
    return isConstant(other,
                      [&](const APInt &c) { return c.isZero() == truth; }) &&
           either(select.getCondition(),
                  truth ? select.getTrueValue() : select.getFalseValue());
  }
  if (isa<arith::XOrIOp>(op))
    return isConstant(op->getOperand(1),
                      [](const APInt &c) { return c.isOne(); }) &&
           holds(op->getOperand(0), !truth, value, below);
  auto compare = dyn_cast<arith::CmpIOp>(op);
  if (!compare)
    return false;
  Predicate predicate = truth ? compare.getPredicate()
                              : arith::invertPredicate(compare.getPredicate());
  if (stripWidening(compare.getLhs()) == value)
    return holds(predicate, compare.getRhs(), below);
  return stripWidening(compare.getRhs()) == value &&
         holds(swap(predicate), compare.getLhs(), below);
}

bool IndexBounds::isGuarded(Value value, bool below) {
  if (!assumed.empty() || !asked.insert({value, below}).second)
    return false;
  bool found = isGuardedHere(value, below);
  asked.erase({value, below});
  return found;
}

bool IndexBounds::isGuardedHere(Value value, bool below) {
  for (Operation *op = at; op && !isa<ProcessOp, AssignOp>(op);
       op = op->getParentOp()) {
    Operation *parent = op->getParentOp();
    if (auto branch = dyn_cast<scf::IfOp>(parent);
        branch &&
        holds(branch.getCondition(),
              op->getParentRegion() == &branch.getThenRegion(), value, below))
      return true;
    if (auto loop = dyn_cast<scf::WhileOp>(parent);
        loop && op->getParentRegion() == &loop.getAfter() &&
        holds(loop.getConditionOp().getCondition(), true, value, below))
      return true;
  }
  return false;
}

//===----------------------------------------------------------------------===//
// Values
//===----------------------------------------------------------------------===//

bool IndexBounds::isNonNegativeArgument(BlockArgument argument) {
  Operation *loop = argument.getOwner()->getParentOp();
  if (isa<ParallelForOp>(loop))
    return true;
  if (auto range = dyn_cast<scf::ForOp>(loop))
    return argument == range.getInductionVar() &&
           isNonNegative(range.getLowerBound());
  if (auto [before, condition] = getConditioned(argument); before)
    return holds(condition, true, stripWidening(before), /*below=*/false) ||
           isNonNegative(before);
  return holdsByInduction(argument, assumed,
                          [&](Value value) { return isNonNegative(value); });
}

/// Whether a sum is one more than an argument of a loop's body that is below
/// something: it does not wrap around.
static bool isStep(arith::AddIOp sum) {
  auto argument = dyn_cast<BlockArgument>(sum.getLhs());
  if (!argument ||
      !isConstant(sum.getRhs(), [](const APInt &c) { return c.isOne(); }))
    return false;
  auto [before, condition] = getConditioned(argument);
  auto compare =
      condition ? condition.getDefiningOp<arith::CmpIOp>() : arith::CmpIOp();
  return compare && ((compare.getPredicate() == Predicate::slt &&
                      compare.getLhs() == before) ||
                     (compare.getPredicate() == Predicate::sgt &&
                      compare.getRhs() == before));
}

bool IndexBounds::isNonNegative(Value value) {
  value = stripWidening(value);
  if (assumed.contains(value) || isGuarded(value, /*below=*/false))
    return true;
  if (auto argument = dyn_cast<BlockArgument>(value))
    return isNonNegativeArgument(argument);
  Operation *op = value.getDefiningOp();
  auto operand = [&](int i) { return isNonNegative(op->getOperand(i)); };
  if (isa<arith::ConstantOp>(op))
    return isConstant(value, [](const APInt &c) { return c.isNonNegative(); });
  if (isa<arith::ExtUIOp, ExtentOp, DomainOp, ListSizeOp>(op))
    return true;
  if (isa<arith::MaxSIOp, arith::AndIOp>(op))
    return operand(0) || operand(1);
  if (isa<arith::MinSIOp, arith::DivSIOp, arith::DivUIOp>(op))
    return operand(0) && operand(1);
  if (isa<arith::MinUIOp, arith::RemUIOp>(op))
    return operand(1) || (isa<arith::MinUIOp>(op) && operand(0));
  if (isa<arith::RemSIOp>(op))
    return operand(0);
  if (isa<arith::ShRUIOp>(op))
    return operand(0) || isConstant(op->getOperand(1), [](const APInt &c) {
             return c.isStrictlyPositive();
           });
  if (auto select = dyn_cast<arith::SelectOp>(op))
    return isNonNegative(select.getTrueValue()) &&
           isNonNegative(select.getFalseValue());
  auto sum = dyn_cast<arith::AddIOp>(op);
  return sum && isStep(sum) && isNonNegative(sum.getLhs());
}

bool IndexBounds::isBelowArgument(BlockArgument argument) {
  Operation *loop = argument.getOwner()->getParentOp();
  if (auto parallel = dyn_cast<ParallelForOp>(loop))
    return isAtMost(parallel.getCount());
  if (auto range = dyn_cast<scf::ForOp>(loop))
    return argument == range.getInductionVar() &&
           isAtMost(range.getUpperBound());
  auto [before, condition] = getConditioned(argument);
  return before &&
         (holds(condition, true, stripWidening(before), /*below=*/true) ||
          isBelow(before));
}

bool IndexBounds::isBelow(Value value) {
  value = stripWidening(value);
  if (isGuarded(value, /*below=*/true))
    return true;
  if (auto argument = dyn_cast<BlockArgument>(value))
    return isBelowArgument(argument);
  Operation *op = value.getDefiningOp();
  auto operand = [&](int i) { return isBelow(op->getOperand(i)); };
  if (isa<arith::MinSIOp>(op))
    return operand(0) || operand(1);
  if (isa<arith::MaxSIOp>(op))
    return operand(0) && operand(1);
  if (auto select = dyn_cast<arith::SelectOp>(op))
    return isBelow(select.getTrueValue()) && isBelow(select.getFalseValue());
  if (isa<arith::ShRUIOp, arith::DivUIOp, arith::RemUIOp>(op))
    return isNonNegative(op->getOperand(0)) && operand(0);
  // What is one less, or some less than what is not negative.
  bool isLess = isa<arith::AddIOp>(op) &&
                isConstant(op->getOperand(1),
                           [](const APInt &c) { return c.isNegative(); });
  bool isOneLess = isLess && isConstant(op->getOperand(1), [](const APInt &c) {
                     return c.isAllOnes();
                   });
  return (isOneLess && isBoundItself(op->getOperand(0))) ||
         (isLess && isNonNegative(op->getOperand(0)) && operand(0));
}

bool IndexBounds::isAtMost(Value value) {
  if (isBoundItself(value))
    return true;
  Operation *op = stripWidening(value).getDefiningOp();
  if (op && isa<arith::MinSIOp>(op))
    return isAtMost(op->getOperand(0)) || isAtMost(op->getOperand(1));
  return isBelow(value);
}
