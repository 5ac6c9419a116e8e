// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Barycentric coordinates, and other quotients by what all lanes share, decide
// whether an iteration goes on: their dividends are tested first, so that
// vectors without an iteration that may go on divide nothing. Integers that are
// divided by what all lanes share, neither 0 nor -1, have no dividend that
// needs a test.

#include "Vectorize/Shape/LaneQuotients.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

/// Whether a comparison with 0 decides for numbers that are negative.
static bool isDecided(arith::CmpFOp test, bool skips) {
  using P = arith::CmpFPredicate;
  return matchPattern(test.getRhs(), m_AnyZeroFloat()) &&
         llvm::is_contained(skips ? ArrayRef<P>{P::OLT, P::OLE, P::ULT, P::ULE}
                                  : ArrayRef<P>{P::OGT, P::OGE, P::UGT, P::UGE},
                            test.getPredicate());
}

/// The quotient by what is the same in all iterations; or null.
static arith::DivFOp findQuotient(Value value, scf::ForOp root) {
  auto quotient = value.getDefiningOp<arith::DivFOp>();
  bool isShared =
      quotient && quotient.getType().isF32() &&
      !root->isAncestor(quotient.getRhs().getParentBlock()->getParentOp());
  return isShared ? quotient : arith::DivFOp();
}

/// What tests compare that decide, where they are negative, that an iteration
/// does not go on.
struct Tested {
  llvm::SetVector<arith::DivFOp> quotients;
  /// Pairs of quotients by one divisor whose sum is taken off 1, as for the
  /// last barycentric coordinate.
  SmallVector<std::pair<arith::DivFOp, arith::DivFOp>> rests;
};

/// The quotients whose sum is taken off 1, in either order.
static std::pair<arith::DivFOp, arith::DivFOp> findRest(Value value) {
  auto quotient = [](Value part) {
    return part.getDefiningOp<arith::DivFOp>();
  };
  auto rest = value.getDefiningOp<arith::SubFOp>();
  if (!rest)
    return {};
  auto isOne = [](Value part) { return matchPattern(part, m_OneFloat()); };
  if (auto sum = rest.getRhs().getDefiningOp<arith::AddFOp>();
      sum && isOne(rest.getLhs()))
    return {quotient(sum.getLhs()), quotient(sum.getRhs())};
  auto before = rest.getLhs().getDefiningOp<arith::SubFOp>();
  if (before && isOne(before.getLhs()))
    return {quotient(before.getRhs()), quotient(rest.getRhs())};
  return {};
}

static void findTested(Value condition, bool skips, scf::ForOp root,
                       Tested &tested) {
  Operation *op = condition.getDefiningOp();
  if (skips ? isa_and_nonnull<arith::OrIOp>(op)
            : isa_and_nonnull<arith::AndIOp>(op)) {
    findTested(op->getOperand(0), skips, root, tested);
    findTested(op->getOperand(1), skips, root, tested);
  } else if (auto test = dyn_cast_or_null<arith::CmpFOp>(op);
             test && isDecided(test, skips)) {
    if (arith::DivFOp quotient = findQuotient(test.getLhs(), root))
      tested.quotients.insert(quotient);
    else if (auto rest = findRest(test.getLhs()); rest.first && rest.second)
      tested.rests.push_back(rest);
  }
}

namespace {

/// Tests of dividends by what is the same in all iterations.
class DividendTests {
public:
  explicit DividendTests(OpBuilder &builder, scf::ForOp root)
      : builder(builder), front(root) {}
  Value isSurelyNegative(arith::DivFOp quotient);
  Value isSurelyNegative(arith::DivFOp a, arith::DivFOp b);

private:
  /// The dividend of the quotient of numbers one of which is the divisor
  /// without its sign.
  Value getDividend(arith::DivFOp quotient);
  Value scale(arith::DivFOp quotient, float factor);
  Value constant(Location loc, float value) {
    return arith::ConstantOp::create(front, loc, front.getF32FloatAttr(value));
  }

  OpBuilder &builder;
  OpBuilder front; ///< before all iterations
};

} // namespace

Value DividendTests::getDividend(arith::DivFOp quotient) {
  Location loc = quotient.getLoc();
  Value sign =
      math::CopySignOp::create(front, loc, constant(loc, 1), quotient.getRhs());
  return arith::MulFOp::create(builder, loc, quotient.getLhs(), sign);
}

Value DividendTests::scale(arith::DivFOp quotient, float factor) {
  Location loc = quotient.getLoc();
  return arith::MulFOp::create(
      front, loc, math::AbsFOp::create(front, loc, quotient.getRhs()),
      constant(loc, factor));
}

/// The dividend has the other sign than the divisor, and is so much larger than
/// nothing that the quotient does not become 0.
Value DividendTests::isSurelyNegative(arith::DivFOp quotient) {
  constexpr float tiny = 0x1p-100F;
  return arith::CmpFOp::create(builder, quotient.getLoc(),
                               arith::CmpFPredicate::OLT, getDividend(quotient),
                               scale(quotient, -tiny));
}

/// Of what is left of 1 after two quotients that are not negative: their sum is
/// more than 1 by more than what all is rounded by, which is less than 2^-21 of
/// it. A divisor that is so small that it loses bits, or is 0, is left to the
/// quotients.
Value DividendTests::isSurelyNegative(arith::DivFOp a, arith::DivFOp b) {
  constexpr float more = 1 + 0x1p-16F, tiny = 0x1p-100F;
  Location loc = b.getLoc();
  Value least = scale(a, more);
  Value isTiny = arith::CmpFOp::create(front, loc, arith::CmpFPredicate::OLT,
                                       least, constant(loc, tiny));
  least = arith::SelectOp::create(
      front, loc, isTiny, constant(loc, std::numeric_limits<float>::infinity()),
      least);
  Value sum =
      arith::AddFOp::create(builder, loc, getDividend(a), getDividend(b));
  return arith::CmpFOp::create(builder, loc, arith::CmpFPredicate::OGT, sum,
                               least);
}

/// Moves what only a block needs into it.
static void sinkInto(Block &block, Operation *end) {
  for (Operation *op = end->getPrevNode(), *before; op; op = before) {
    before = op->getPrevNode();
    bool isOnly = isPure(op) && !op->use_empty() &&
                  llvm::all_of(op->getUsers(), [&](Operation *user) {
                    return block.findAncestorOpInBlock(*user);
                  });
    if (isOnly)
      op->moveBefore(&block, block.begin());
  }
}

static void testDividends(scf::IfOp choice, scf::ForOp root) {
  bool skips = choice.getThenRegion().front().without_terminator().empty();
  bool hasElse = !choice.getElseRegion().empty() &&
                 !choice.getElseRegion().front().without_terminator().empty();
  Tested tested;
  if (choice.getNumResults() == 0 && skips == hasElse)
    findTested(choice.getCondition(), skips, root, tested);
  if (tested.quotients.empty())
    return;
  OpBuilder builder(choice);
  Location loc = choice.getLoc();
  DividendTests tests(builder, root);
  Value isOut;
  auto add = [&](Value negative) {
    isOut =
        isOut ? arith::OrIOp::create(builder, loc, isOut, negative) : negative;
  };
  for (arith::DivFOp quotient : tested.quotients)
    add(tests.isSurelyNegative(quotient));
  // Where one of the two is negative, it decides itself.
  for (auto [a, b] : tested.rests)
    if (tested.quotients.contains(a) && tested.quotients.contains(b) &&
        a.getRhs() == b.getRhs())
      add(tests.isSurelyNegative(a, b));
  Value yes = arith::ConstantIntOp::create(builder, loc, 1, 1);
  Value mayGoOn = arith::XOrIOp::create(builder, loc, isOut, yes);
  auto around = scf::IfOp::create(builder, loc, mayGoOn, /*withElse=*/false);
  choice->moveBefore(around.thenBlock(), around.thenBlock()->begin());
  sinkInto(*around.thenBlock(), around);
}

void piko::testDividends(scf::ForOp root) {
  SmallVector<scf::IfOp> choices;
  root.walk([&](scf::IfOp choice) { choices.push_back(choice); });
  for (scf::IfOp choice : choices)
    ::testDividends(choice, root);
}

namespace {

/// What decides whether a division of integers has a result: what all lanes
/// share, and what else is enough for that where a lane's dividend is not.
struct DivisionTest {
  Value needed, enough;
};

} // namespace

/// The divisor is not 0, and either the dividend is not the lowest number or
/// the divisor not -1.
static std::optional<DivisionTest>
findDivisionTest(scf::IfOp choice, const IterationLanes &lanes) {
  auto both = choice.getCondition().getDefiningOp<arith::AndIOp>();
  if (!both || choice.getNumResults() != 1 || choice.getElseRegion().empty())
    return std::nullopt;
  Operation *division = &choice.thenBlock()->front();
  if (!isIntegerDivision(division) ||
      division->getNextNode() != choice.thenYield() ||
      choice.thenYield().getOperand(0) != division->getResult(0))
    return std::nullopt;
  for (unsigned i : {0, 1}) {
    Value needed = both->getOperand(i);
    auto either = both->getOperand(1 - i).getDefiningOp<arith::OrIOp>();
    if (!either || lanes.isVarying(needed))
      continue;
    for (unsigned j : {0, 1})
      if (!lanes.isVarying(either->getOperand(j)) &&
          lanes.isVarying(either->getOperand(1 - j)))
        return DivisionTest{needed, either->getOperand(j)};
  }
  return std::nullopt;
}

static void testDivisor(scf::IfOp choice, const DivisionTest &test) {
  OpBuilder builder(choice);
  Location loc = choice.getLoc();
  Value sure = arith::AndIOp::create(builder, loc, test.needed, test.enough);
  auto around = scf::IfOp::create(builder, loc, choice.getResultTypes(), sure,
                                  /*withElseRegion=*/true);
  choice->replaceAllUsesWith(around);
  choice->moveBefore(around.elseBlock(), around.elseBlock()->end());
  builder.setInsertionPointToEnd(around.elseBlock());
  scf::YieldOp::create(builder, loc, choice.getResults());
  builder.setInsertionPointToStart(around.thenBlock());
  Operation *division = builder.clone(choice.thenBlock()->front());
  scf::YieldOp::create(builder, loc, division->getResults());
}

void piko::testDivisors(const IterationLanes &lanes) {
  SmallVector<std::pair<scf::IfOp, DivisionTest>> found;
  scf::ForOp root = lanes.getLoop();
  root.walk([&](scf::IfOp choice) {
    if (std::optional<DivisionTest> test = findDivisionTest(choice, lanes))
      found.emplace_back(choice, *test);
  });
  for (auto &[choice, test] : found)
    testDivisor(choice, test);
}
