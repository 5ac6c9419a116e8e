//===- Recurrence.cpp - How arguments of loops change ---------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// By induction: what is said of an argument holds at first, and if it holds in
// one turn of the loop, then also in the next. All is said of numbers that do
// not wrap around.
//
//===----------------------------------------------------------------------===//

#include "Piko/Analysis/LinearFacts.h"

using namespace mlir;
using namespace piko;

/// The bound that a loop runs up or down to by `!=`, which stands still; null
/// if its condition is another one.
static Value findUnequalBound(BlockArgument argument, scf::WhileOp loop) {
  auto compare =
      loop.getConditionOp().getCondition().getDefiningOp<arith::CmpIOp>();
  if (!compare || compare.getPredicate() != arith::CmpIPredicate::ne)
    return {};
  for (auto [value, bound] : {std::pair(compare.getLhs(), compare.getRhs()),
                              std::pair(compare.getRhs(), compare.getLhs())})
    if (value == argument &&
        !loop->isAncestor(bound.getParentBlock()->getParentOp()))
      return bound;
  return {};
}

/// Whether an argument never passes a bound that its loop ends at.
static bool keepsTo(Value bound, bool isCeiling, BlockArgument argument,
                    scf::WhileOp loop, FactsProvider &provider) {
  unsigned i = argument.getArgNumber();
  auto difference = [&](LinearFacts &facts, Value value) {
    Linear rest = facts.get(bound) - facts.get(value);
    return isCeiling ? rest : Linear(0) - rest;
  };
  LinearFacts before(loop, provider);
  if (!before.isAtLeastZero(difference(before, loop.getInits()[i])))
    return false;
  LinearFacts after(loop.getYieldOp(), provider);
  after.assumeAtMost(isCeiling ? argument : bound,
                     isCeiling ? bound : argument);
  return after.isAtLeastZero(
      difference(after, loop.getYieldOp().getResults()[i]));
}

Recurrence piko::findRecurrence(BlockArgument argument,
                                FactsProvider &provider) {
  Recurrence result;
  auto loop = dyn_cast<scf::WhileOp>(argument.getOwner()->getParentOp());
  if (!loop || argument.getOwner() != loop.getBeforeBody())
    return result;
  if (Value bound = findUnequalBound(argument, loop)) {
    if (keepsTo(bound, /*isCeiling=*/true, argument, loop, provider))
      result.ceiling = bound;
    else if (keepsTo(bound, /*isCeiling=*/false, argument, loop, provider))
      result.floor = bound;
  }
  LinearFacts facts(loop.getYieldOp(), provider);
  if (result.ceiling)
    facts.assumeAtMost(argument, result.ceiling);
  if (result.floor)
    facts.assumeAtMost(result.floor, argument);
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
