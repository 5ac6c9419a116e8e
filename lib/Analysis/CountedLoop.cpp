// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Analysis/CountedLoop.h"

#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

/// The predicate of the same comparison with its sides exchanged.
static Predicate exchangeSides(Predicate predicate) {
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
  case Predicate::eq:
  case Predicate::ne:
    return predicate;
  }
  llvm_unreachable("not a comparison");
}

/// Takes a condition apart into bounds of one number, an argument of the loop's
/// test; false if it says more.
static bool addBounds(Value condition, scf::WhileOp loop,
                      BlockArgument &compared, CountedLoop &counted) {
  if (auto both = condition.getDefiningOp<arith::AndIOp>())
    return addBounds(both.getLhs(), loop, compared, counted) &&
           addBounds(both.getRhs(), loop, compared, counted);
  auto compare = condition.getDefiningOp<arith::CmpIOp>();
  if (!compare)
    return false;
  auto isNumber = [&](Value side) {
    auto argument = dyn_cast<BlockArgument>(side);
    return argument && argument.getOwner() == loop.getBeforeBody() &&
           (!compared || argument == compared);
  };
  Value number = compare.getLhs(), end = compare.getRhs();
  Predicate predicate = compare.getPredicate();
  if (!isNumber(number)) {
    if (!isNumber(end))
      return false;
    std::swap(number, end);
    predicate = exchangeSides(predicate);
  }
  compared = cast<BlockArgument>(number);
  counted.bounds.push_back({predicate, end, compare});
  return true;
}

static std::optional<CountedLoop> findCountedWhile(scf::WhileOp loop) {
  CountedLoop counted;
  counted.loop = loop;
  counted.body = loop.getAfterBody();
  BlockArgument compared;
  if (!addBounds(loop.getConditionOp().getCondition(), loop, compared, counted))
    return std::nullopt;
  counted.number = compared.getArgNumber();
  counted.first = loop.getInits()[counted.number];
  auto next = loop.getYieldOp()
                  .getResults()[counted.number]
                  .getDefiningOp<arith::AddIOp>();
  if (!next)
    return std::nullopt;
  for (auto [after, value] :
       llvm::zip(loop.getAfterArguments(), loop.getConditionOp().getArgs()))
    if (value == compared && next.getLhs() == after)
      counted.counter = after;
  APInt step;
  if (!counted.counter || !matchPattern(next.getRhs(), m_ConstantInt(&step)))
    return std::nullopt;
  counted.step = step;
  return counted;
}

std::optional<CountedLoop> piko::findCountedLoop(Operation *op) {
  if (auto repeated = dyn_cast<scf::WhileOp>(op))
    return findCountedWhile(repeated);
  auto range = dyn_cast<scf::ForOp>(op);
  if (!range)
    return std::nullopt;
  CountedLoop counted;
  counted.loop = range;
  counted.body = range.getBody();
  counted.counter = cast<BlockArgument>(range.getInductionVar());
  counted.first = range.getLowerBound();
  counted.bounds.push_back(
      {range.getUnsignedCmp() ? Predicate::ult : Predicate::slt,
       range.getUpperBound(), range});
  APInt step;
  if (matchPattern(range.getStep(), m_ConstantInt(&step)))
    counted.step = step;
  return counted;
}

static scf::WhileOp asWhile(LoopLikeOpInterface loop) {
  return dyn_cast<scf::WhileOp>(loop.getOperation());
}

const CountedLoop::Bound *CountedLoop::getBound() const {
  if (bounds.size() != 1)
    return nullptr;
  Value end = bounds.front().end;
  Operation *around = end.getParentBlock()->getParentOp();
  return LoopLikeOpInterface(loop)->isAncestor(around) ? nullptr : &bounds[0];
}

bool CountedLoop::onlyCompares() const {
  scf::WhileOp repeated = asWhile(loop);
  if (!repeated)
    return true;
  Block &before = *repeated.getBeforeBody();
  return before.getOperations().size() == bounds.size() + 1 &&
         llvm::equal(repeated.getConditionOp().getArgs(),
                     before.getArguments());
}

Operation *CountedLoop::getNext() const {
  scf::WhileOp repeated = asWhile(loop);
  return repeated ? repeated.getYieldOp().getResults()[number].getDefiningOp()
                  : nullptr;
}
