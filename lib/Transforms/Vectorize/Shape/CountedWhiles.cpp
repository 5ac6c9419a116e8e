// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Vectorize/Shape/CountedWhiles.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/Matchers.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

using namespace mlir;
using namespace piko;

std::optional<CountedWhile> piko::findCountedWhile(scf::WhileOp loop) {
  Block &before = *loop.getBeforeBody(), &after = *loop.getAfterBody();
  scf::ConditionOp condition = loop.getConditionOp();
  auto compare = dyn_cast<arith::CmpIOp>(before.front());
  if (!compare || compare->getNextNode() != condition ||
      condition.getCondition() != compare.getResult() ||
      !llvm::equal(condition.getArgs(), before.getArguments()) ||
      compare.getRhs().getParentBlock() == &before)
    return {};
  auto variable = dyn_cast<BlockArgument>(compare.getLhs());
  if (!variable || variable.getOwner() != &before)
    return {};
  using P = arith::CmpIPredicate;
  CountedWhile counting{variable.getArgNumber(), compare.getRhs(),
                        compare.getPredicate() == P::sle};
  // Up to a number, from 0: one below it would take 2^63 iterations.
  bool isUntil = compare.getPredicate() == P::ne &&
                 counting.bound.getType().isInteger(64) &&
                 matchPattern(loop.getInits()[counting.variable], m_Zero());
  auto next = after.getTerminator()
                  ->getOperand(counting.variable)
                  .getDefiningOp<arith::AddIOp>();
  bool isCounted =
      next && next.getLhs() == after.getArgument(counting.variable) &&
      matchPattern(next.getRhs(), m_One()) &&
      (counting.isClosed || isUntil || compare.getPredicate() == P::slt);
  // The bound may be the largest number, where 64 bits have no next one.
  bool fits = !counting.isClosed || counting.bound.getType().isInteger(32);
  return isCounted && fits ? counting : std::optional<CountedWhile>();
}

scf::ForOp piko::countLoop(scf::WhileOp loop, const CountedWhile &counting) {
  IRRewriter builder(loop->getContext());
  builder.setInsertionPoint(loop);
  Location loc = loop.getLoc();
  Type index = builder.getIndexType(), type = counting.bound.getType();
  auto cast = [&](Value number, Type type) -> Value {
    return number.getType() == type
               ? number
               : builder.createOrFold<arith::IndexCastOp>(loc, type, number);
  };
  SmallVector<Value> inits(loop.getInits());
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  Value lower = cast(inits[counting.variable], index),
        upper = cast(counting.bound, index);
  if (counting.isClosed)
    upper = arith::AddIOp::create(builder, loc, upper, one);
  inits.erase(inits.begin() + counting.variable);
  auto made = scf::ForOp::create(builder, loc, lower, upper, one, inits);
  Block *body = made.getBody(), *from = loop.getAfterBody();
  if (!body->empty())
    builder.eraseOp(body->getTerminator());
  builder.setInsertionPointToStart(body);
  SmallVector<Value> variables(made.getRegionIterArgs());
  variables.insert(variables.begin() + counting.variable,
                   cast(made.getInductionVar(), type));
  Operation *yield = from->getTerminator();
  yield->eraseOperand(counting.variable);
  builder.inlineBlockBefore(from, body, body->end(), variables);
  builder.setInsertionPointAfter(made);
  SmallVector<Value> results(made.getResults());
  Value last = cast(arith::MaxSIOp::create(builder, loc, lower, upper), type);
  results.insert(results.begin() + counting.variable, last);
  builder.replaceOp(loop, results);
  // The bounds of loops inside stand outside of this one.
  moveLoopInvariantCode(made);
  return made;
}

void piko::countLoops(scf::ForOp root) {
  SmallVector<scf::WhileOp> loops;
  root.walk([&](scf::WhileOp loop) { loops.push_back(loop); });
  for (scf::WhileOp loop : loops)
    if (std::optional<CountedWhile> counting = findCountedWhile(loop))
      countLoop(loop, *counting);
}
