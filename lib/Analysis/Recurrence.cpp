//===- Recurrence.cpp - How arguments of loops change ---------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// By induction: what is said of an argument holds at first, and if it holds in
// one iteration of the loop, then also in the next. All is said of numbers that
// do not wrap around.
//
//===----------------------------------------------------------------------===//

#include "Piko/Analysis/LinearFacts.h"

#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

/// The comparisons that all hold where a condition does.
static void findComparisons(Value condition,
                            SmallVectorImpl<arith::CmpIOp> &found) {
  Operation *op = condition.getDefiningOp();
  if (auto compare = dyn_cast_or_null<arith::CmpIOp>(op))
    found.push_back(compare);
  auto select = dyn_cast_or_null<arith::SelectOp>(op);
  bool isBoth = select && matchPattern(select.getFalseValue(), m_Zero());
  if (isBoth || isa_and_nonnull<arith::AndIOp>(op))
    for (Value operand : op->getOperands().take_front(2))
      findComparisons(operand, found);
}

/// Bounds that stand still and that the condition of a loop compares with: by
/// `!=` with the argument, or in any way with what may wrap around for all that
/// its type says.
static SmallVector<Value> findBounds(BlockArgument argument,
                                     scf::WhileOp loop) {
  SmallVector<arith::CmpIOp> comparisons;
  findComparisons(loop.getConditionOp().getCondition(), comparisons);
  bool isWide =
      argument.getType().isIndex() || argument.getType().isInteger(64);
  SmallVector<Value> bounds;
  for (arith::CmpIOp compare : comparisons) {
    if (compare.getLhs().getType() != argument.getType())
      continue;
    bool isUnequal = compare.getPredicate() == arith::CmpIPredicate::ne;
    for (auto [value, bound] : {std::pair(compare.getLhs(), compare.getRhs()),
                                std::pair(compare.getRhs(), compare.getLhs())})
      if (((isUnequal && value == argument) || isWide) &&
          !loop->isAncestor(bound.getParentBlock()->getParentOp()))
        bounds.push_back(bound);
  }
  return bounds;
}

namespace {
/// What an argument is never above or below, while its loop runs.
struct Limits {
  BlockArgument argument;
  Value ceiling, floor;

  void assume(LinearFacts &facts) const {
    if (ceiling)
      facts.assumeAtMost(argument, ceiling);
    if (floor)
      facts.assumeAtMost(floor, argument);
  }
  bool hold(LinearFacts &facts, Value value) const {
    Linear number = facts.get(value);
    return (!ceiling || facts.isAtLeastZero(facts.get(ceiling) - number)) &&
           (!floor || facts.isAtLeastZero(number - facts.get(floor)));
  }
  /// Whether they hold at first, and then in each iteration.
  bool hold(scf::WhileOp loop, FactsProvider &provider) const {
    unsigned i = argument.getArgNumber();
    LinearFacts before(loop, provider);
    if (!hold(before, loop.getInits()[i]))
      return false;
    LinearFacts after(loop.getYieldOp(), provider,
                      [&](LinearFacts &facts) { assume(facts); });
    return hold(after, loop.getYieldOp().getResults()[i]);
  }
};
} // namespace

/// Limits of which one is a bound that the loop ends at, and the other,
/// perhaps, where the argument begins.
static Limits findLimits(BlockArgument argument, scf::WhileOp loop,
                         FactsProvider &provider) {
  Value init = loop.getInits()[argument.getArgNumber()];
  for (Value bound : findBounds(argument, loop))
    for (Limits limits :
         {Limits{argument, bound, init}, Limits{argument, init, bound},
          Limits{argument, bound, {}}, Limits{argument, {}, bound}})
      if (limits.hold(loop, provider))
        return limits;
  return {argument, {}, {}};
}

Recurrence piko::findRecurrence(BlockArgument argument,
                                FactsProvider &provider) {
  Recurrence result;
  auto loop = dyn_cast<scf::WhileOp>(argument.getOwner()->getParentOp());
  if (!loop || argument.getOwner() != loop.getBeforeBody())
    return result;
  Limits limits = findLimits(argument, loop, provider);
  result.ceiling = limits.ceiling;
  result.floor = limits.floor;
  LinearFacts facts(loop.getYieldOp(), provider,
                    [&](LinearFacts &known) { limits.assume(known); });
  Linear now = facts.get(argument);
  Linear next =
      facts.get(loop.getYieldOp().getResults()[argument.getArgNumber()]);
  Linear added = next - now;
  if (std::optional<llvm::DynamicAPInt> step = added.getConstant())
    result.step = int64_t(*step);
  else if (facts.isAtLeastZero(added))
    result.rises = true;
  else if (facts.isAtLeastZero(now - next))
    result.falls = true;
  return result;
}
