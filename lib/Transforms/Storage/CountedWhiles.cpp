// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Transforms/Storage/CountedWhiles.h"

#include "mlir/IR/Matchers.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

using namespace mlir;
using namespace piko;

std::optional<CountedLoop> piko::findUpliftableWhile(scf::WhileOp loop) {
  std::optional<CountedLoop> counted = findCountedLoop(loop);
  const CountedLoop::Bound *bound = counted ? counted->getBound() : nullptr;
  if (!bound || !counted->isByOne() || !counted->onlyCompares())
    return std::nullopt;
  Type type = counted->first.getType();
  bool counts = false;
  switch (bound->predicate) {
  case arith::CmpIPredicate::slt:
    counts = true;
    break;
  case arith::CmpIPredicate::sle:
    // The bound may be the largest number, where 64 bits have no next one.
    counts = type.isInteger(32);
    break;
  case arith::CmpIPredicate::ult:
    // 64 bits have room for 32 without a sign.
    counts = type.isInteger(32) ||
             (type.isInteger(64) && matchPattern(counted->first, m_Zero()));
    break;
  case arith::CmpIPredicate::ne:
    // From 0 to a number below it would take 2^63 iterations.
    counts = type.isInteger(64) && matchPattern(counted->first, m_Zero());
    break;
  default:
    break;
  }
  return counts ? counted : std::nullopt;
}

/// Where a number without a sign is extended, it is the one of 64 bits that it
/// was made of.
static void replaceExtended(IRRewriter &builder, Value number, Value wide) {
  for (Operation *user : llvm::make_early_inc_range(number.getUsers())) {
    if (!isa<arith::ExtUIOp, arith::IndexCastUIOp>(user))
      continue;
    builder.setInsertionPoint(user);
    Type type = user->getResult(0).getType();
    builder.replaceOp(user, type.isIndex()
                                ? wide
                                : arith::IndexCastOp::create(
                                      builder, user->getLoc(), type, wide)
                                      .getResult());
  }
}

scf::ForOp piko::upliftWhile(scf::WhileOp loop, const CountedLoop &counted,
                             SmallVectorImpl<Value> *replaced) {
  const CountedLoop::Bound &bound = counted.bounds.front();
  unsigned variable = counted.number;
  IRRewriter builder(loop->getContext());
  builder.setInsertionPoint(loop);
  Location loc = loop.getLoc();
  Type index = builder.getIndexType(), type = bound.end.getType();
  bool isUnsigned = bound.predicate == arith::CmpIPredicate::ult;
  auto cast = [&](Value number, Type type) -> Value {
    if (number.getType() == type)
      return number;
    return isUnsigned && type.isIndex()
               ? builder.createOrFold<arith::IndexCastUIOp>(loc, type, number)
               : builder.createOrFold<arith::IndexCastOp>(loc, type, number);
  };
  SmallVector<Value> inits(loop.getInits());
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  Value lower = cast(inits[variable], index), upper = cast(bound.end, index);
  if (bound.predicate == arith::CmpIPredicate::sle)
    upper = arith::AddIOp::create(builder, loc, upper, one);
  inits.erase(inits.begin() + variable);
  auto made = scf::ForOp::create(builder, loc, lower, upper, one, inits);
  Block *body = made.getBody(), *from = loop.getAfterBody();
  if (!body->empty())
    builder.eraseOp(body->getTerminator());
  builder.setInsertionPointToStart(body);
  SmallVector<Value> variables(made.getRegionIterArgs());
  variables.insert(variables.begin() + variable,
                   cast(made.getInductionVar(), type));
  Operation *yield = from->getTerminator();
  yield->eraseOperand(variable);
  builder.inlineBlockBefore(from, body, body->end(), variables);
  if (isUnsigned)
    replaceExtended(builder, variables[variable], made.getInductionVar());
  builder.setInsertionPointAfter(made);
  SmallVector<Value> results(made.getResults());
  Value last = cast(arith::MaxSIOp::create(builder, loc, lower, upper), type);
  results.insert(results.begin() + variable, last);
  if (replaced)
    replaced->assign(results.begin(), results.end());
  builder.replaceOp(loop, results);
  // The bounds of loops inside stand outside of this one.
  moveLoopInvariantCode(made);
  return made;
}

void piko::upliftWhiles(scf::ForOp root) {
  SmallVector<scf::WhileOp> loops;
  root.walk([&](scf::WhileOp loop) { loops.push_back(loop); });
  for (scf::WhileOp loop : loops)
    if (std::optional<CountedLoop> counted = findUpliftableWhile(loop))
      upliftWhile(loop, *counted);
}
