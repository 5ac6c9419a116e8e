// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-narrow-integers: signs of affine functions of a pixel in 32 bits, where
// a test in front of the loop finds that they fit.

#include "Lanes.h"

#include "Piko/Transforms/Passes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

namespace piko {
#define GEN_PASS_DEF_NARROWINTEGERS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct NarrowIntegersPass : piko::impl::NarrowIntegersBase<NarrowIntegersPass> {
  void runOnOperation() override;
};

/// base + coefficients[i] * variable i, modulo 2^64; null for 0.
struct Affine {
  Value base;
  std::array<Value, 2> coefficients;
};

/// A function of the pixel whose sign matters, as a difference if there is a
/// second one.
struct Leaf {
  Value plus, minus;

  bool operator==(const Leaf &) const = default;
};

/// A comparison that is the sign of a tree of leaves: of one leaf, if it is a
/// difference, or of bits and of minima and maxima of several.
struct SignTest {
  arith::CmpIOp compare;
  bool isNegative = false; ///< Or it holds where the sign is clear.
  Value tree;              ///< null if the leaf is a difference
  Leaf leaf;
};

/// A loop over the pixels of a row and, if there is one, the loop over rows.
class Nest {
public:
  explicit Nest(scf::ForOp row);

  /// Makes a second version of the loops; how many comparisons became narrow.
  int64_t narrow();

private:
  bool isInvariant(Value value) const {
    return !outer->isAncestor(value.getParentRegion()->getParentOp());
  }
  bool isAffine(Value value);
  bool computeIsAffine(Value value);
  bool isTree(Value value);
  std::optional<SignTest> matchTest(arith::CmpIOp compare);
  void collectLeaves(Value tree);

  Affine expand(Value value);
  Affine computeExpansion(Value value);
  Affine expandArgument(BlockArgument argument);
  Affine getAffine(const Leaf &leaf);
  Value getTwo(bool isSum, Value a, Value b);
  /// A bound of a loop in 64 bits.
  Value extend(Value bound);

  void addCheck(Affine affine);
  void prepare(const Leaf &leaf);
  Value writeLeaf(const Leaf &leaf, OpBuilder &inner);
  /// `written` has what this comparison has already.
  Value writeTree(Value tree, OpBuilder &inner,
                  llvm::DenseMap<Value, Value> &written);

  scf::ForOp row, outer;
  SmallVector<scf::ForOp, 2> loops; ///< from outside
  SmallVector<SignTest> tests;
  // What is known of values, which may be used more than once.
  llvm::DenseMap<Value, bool> affine, trees;
  llvm::DenseMap<Value, Affine> expanded;
  llvm::DenseSet<Value> collected;
  OpBuilder builder;
  Location loc;
  Value fits;

  /// What a leaf is in 32 bits, without the bits below its steps.
  struct Narrow {
    Leaf leaf;
    Value base;
    std::array<Value, 2> steps;
    Value value; ///< in the new loop
  };
  SmallVector<Narrow> leaves;
  SmallVector<scf::ForOp, 2> made;
};

} // namespace

static bool isStepOne(scf::ForOp loop) {
  return matchPattern(loop.getStep(), m_One());
}

Nest::Nest(scf::ForOp row)
    : row(row), outer(row), builder(row), loc(row.getLoc()) {
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

//===----------------------------------------------------------------------===//
// What is affine
//===----------------------------------------------------------------------===//

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

bool Nest::isAffine(Value value) {
  if (auto known = affine.find(value); known != affine.end())
    return known->second;
  bool result = computeIsAffine(value);
  affine[value] = result;
  return result;
}

bool Nest::computeIsAffine(Value value) {
  if (isInvariant(value))
    return value.getType().isInteger(64);
  if (auto argument = dyn_cast<BlockArgument>(value)) {
    auto loop = dyn_cast<scf::ForOp>(argument.getOwner()->getParentOp());
    if (!loop || !llvm::is_contained(loops, loop) ||
        !value.getType().isInteger(64))
      return false;
    if (argument == loop.getInductionVar())
      return true;
    Value increment = getIncrement(argument, loop);
    return increment && isInvariant(increment) &&
           isAffine(loop.getTiedLoopInit(argument)->get());
  }
  Operation *op = value.getDefiningOp();
  if (isa<arith::ExtSIOp, arith::IndexCastOp>(op)) {
    Value variable = op->getOperand(0);
    return value.getType().isInteger(64) &&
           llvm::any_of(loops, [&](scf::ForOp loop) {
             return loop.getInductionVar() == variable;
           });
  }
  if (!value.getType().isInteger(64))
    return false;
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

bool Nest::isTree(Value value) {
  if (isAffine(value))
    return true;
  if (auto known = trees.find(value); known != trees.end())
    return known->second;
  Operation *op = value.getDefiningOp();
  return trees[value] = op && outer->isProperAncestor(op) &&
                        isa<arith::OrIOp, arith::AndIOp, arith::XOrIOp,
                            arith::MaxSIOp, arith::MinSIOp>(op) &&
                        isTree(op->getOperand(0)) && isTree(op->getOperand(1));
}

std::optional<SignTest> Nest::matchTest(arith::CmpIOp compare) {
  using P = arith::CmpIPredicate;
  P predicate = compare.getPredicate();
  Value lhs = compare.getLhs(), rhs = compare.getRhs();
  bool isSigned = predicate == P::slt || predicate == P::sle ||
                  predicate == P::sgt || predicate == P::sge;
  if (!isSigned || !lhs.getType().isInteger(64) ||
      (isInvariant(lhs) && isInvariant(rhs)))
    return {};
  APInt bound;
  bool isSign =
      matchPattern(rhs, m_ConstantInt(&bound)) &&
      ((bound.isZero() && (predicate == P::slt || predicate == P::sge)) ||
       (bound.isAllOnes() && (predicate == P::sgt || predicate == P::sle)));
  if (isSign && isTree(lhs))
    return SignTest{
        compare, predicate == P::slt || predicate == P::sle, lhs, {}};
  if (!isAffine(lhs) || !isAffine(rhs))
    return {};
  // a > b is b - a < 0; a <= b is b - a >= 0.
  bool isTurned = predicate == P::sgt || predicate == P::sle;
  return SignTest{compare,
                  predicate == P::slt || predicate == P::sgt,
                  {},
                  isTurned ? Leaf{rhs, lhs} : Leaf{lhs, rhs}};
}

//===----------------------------------------------------------------------===//
// In front of the loops
//===----------------------------------------------------------------------===//

Value Nest::getTwo(bool isSum, Value a, Value b) {
  if (!b)
    return a;
  if (!a && isSum)
    return b;
  if (!a)
    a = arith::ConstantIntOp::create(builder, loc, 0, 64);
  return isSum ? arith::AddIOp::create(builder, loc, a, b).getResult()
               : arith::SubIOp::create(builder, loc, a, b).getResult();
}

Value Nest::extend(Value bound) {
  Type wide = builder.getI64Type();
  if (bound.getType().isIndex())
    return arith::IndexCastOp::create(builder, loc, wide, bound);
  if (bound.getType() != wide)
    return arith::ExtSIOp::create(builder, loc, wide, bound);
  return bound;
}

/// Of a variable that grows by one: what it is at the first iteration is its
/// value less that of the induction variable there, which counts from another
/// number.
Affine Nest::expandArgument(BlockArgument argument) {
  auto loop = cast<scf::ForOp>(argument.getOwner()->getParentOp());
  unsigned number = loop == loops.front() ? 0 : 1;
  Affine result;
  if (argument == loop.getInductionVar()) {
    result.coefficients[number] =
        arith::ConstantIntOp::create(builder, loc, 1, 64);
    return result;
  }
  Value increment = getIncrement(argument, loop);
  Value lower = extend(loop.getLowerBound());
  result = expand(loop.getTiedLoopInit(argument)->get());
  result.base = getTwo(false, result.base,
                       arith::MulIOp::create(builder, loc, increment, lower));
  result.coefficients[number] =
      getTwo(true, result.coefficients[number], increment);
  return result;
}

Affine Nest::expand(Value value) {
  if (auto known = expanded.find(value); known != expanded.end())
    return known->second;
  Affine result = computeExpansion(value);
  expanded[value] = result;
  return result;
}

Affine Nest::computeExpansion(Value value) {
  if (isInvariant(value))
    return {value, {}};
  if (auto argument = dyn_cast<BlockArgument>(value))
    return expandArgument(argument);
  Operation *op = value.getDefiningOp();
  if (isa<arith::ExtSIOp, arith::IndexCastOp>(op))
    return expandArgument(cast<BlockArgument>(op->getOperand(0)));
  if (matchPattern(value, m_Constant()))
    return {builder.clone(*op)->getResult(0), {}};
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
    Value ones = arith::ConstantIntOp::create(builder, loc, -1, 64);
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

Affine Nest::getAffine(const Leaf &leaf) {
  Affine a = expand(leaf.plus);
  if (!leaf.minus)
    return a;
  Affine b = expand(leaf.minus);
  a.base = getTwo(false, a.base, b.base);
  for (auto [x, y] : llvm::zip(a.coefficients, b.coefficients))
    x = getTwo(false, x, y);
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

/// The coefficients without the bits that all of them have as 0, and the base
/// without its own there: the function divided by a power of two, and rounded
/// down, which has the same sign.
static void shiftDown(Affine &affine, OpBuilder &builder, Location loc) {
  unsigned zeros = 24;
  for (Value coefficient : affine.coefficients)
    if (coefficient)
      zeros = std::min(zeros, countZeros(coefficient));
  if (zeros == 0)
    return;
  Value by = arith::ConstantIntOp::create(builder, loc, zeros, 64);
  auto shift = [&](Value &value) {
    if (value)
      value = arith::ShRSIOp::create(builder, loc, value, by);
  };
  shift(affine.base);
  for (Value &coefficient : affine.coefficients)
    shift(coefficient);
}

/// Extends the test by whether a function fits into 32 bits at the corners of
/// the loops' domain, hence at all pixels.
///
/// A base of 62 bits, steps of 32 and variables of 28 make what is computed
/// here, so that nothing of it overflows.
void Nest::addCheck(Affine affine) {
  auto constant = [&](int64_t value) -> Value {
    return arith::ConstantIntOp::create(builder, loc, value, 64);
  };
  auto require = [&](Value value, int bits) {
    // As unsigned, so that one comparison is enough.
    Value moved =
        arith::AddIOp::create(builder, loc, value, constant(1ll << (bits - 1)));
    Value isIn = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ult,
                                       moved, constant(1ll << bits));
    fits = fits ? arith::AndIOp::create(builder, loc, fits, isIn).getResult()
                : isIn;
  };
  Value least = affine.base ? affine.base : constant(0);
  require(least, 62);
  Value most = least;
  for (auto [loop, step] : llvm::zip(loops, affine.coefficients)) {
    if (!step)
      continue;
    require(step, 32);
    Value first = extend(loop.getLowerBound()),
          end = extend(loop.getUpperBound());
    require(first, 28);
    require(end, 28);
    Value last = arith::SubIOp::create(builder, loc, end, constant(1));
    Value atFirst = arith::MulIOp::create(builder, loc, step, first),
          atLast = arith::MulIOp::create(builder, loc, step, last);
    least = arith::AddIOp::create(
        builder, loc, least,
        arith::MinSIOp::create(builder, loc, atFirst, atLast));
    most = arith::AddIOp::create(
        builder, loc, most,
        arith::MaxSIOp::create(builder, loc, atFirst, atLast));
  }
  require(least, 32);
  if (most != least)
    require(most, 32);
}

void Nest::prepare(const Leaf &leaf) {
  if (llvm::any_of(leaves, [&](const Narrow &n) { return n.leaf == leaf; }))
    return;
  // What a difference is made of must not overflow, either.
  if (leaf.minus)
    for (Value part : {leaf.plus, leaf.minus}) {
      Affine affine = expand(part);
      shiftDown(affine, builder, loc);
      addCheck(affine);
    }
  Affine affine = getAffine(leaf);
  shiftDown(affine, builder, loc);
  addCheck(affine);
  auto cut = [&](Value value) -> Value {
    return value ? arith::TruncIOp::create(builder, loc, builder.getI32Type(),
                                           value)
                       .getResult()
                 : value;
  };
  leaves.push_back({leaf,
                    cut(affine.base),
                    {cut(affine.coefficients[0]), cut(affine.coefficients[1])},
                    {}});
}

void Nest::collectLeaves(Value tree) {
  if (!collected.insert(tree).second)
    return;
  if (isAffine(tree))
    return prepare({tree, {}});
  for (Value operand : tree.getDefiningOp()->getOperands())
    collectLeaves(operand);
}

//===----------------------------------------------------------------------===//
// Inside
//===----------------------------------------------------------------------===//

Value Nest::writeLeaf(const Leaf &leaf, OpBuilder &inner) {
  auto *found =
      llvm::find_if(leaves, [&](const Narrow &n) { return n.leaf == leaf; });
  if (found->value)
    return found->value;
  // Modulo 2^32, which is exact, for the result fits.
  Value sum = found->base;
  for (auto [loop, step] : llvm::zip(made, found->steps)) {
    if (!step)
      continue;
    OpBuilder body = OpBuilder::atBlockBegin(loop.getBody());
    Value variable = loop.getInductionVar();
    Type narrow = body.getI32Type();
    if (variable.getType().isIndex())
      variable = arith::IndexCastOp::create(body, loc, narrow, variable);
    else if (!variable.getType().isInteger(32))
      variable = arith::TruncIOp::create(body, loc, narrow, variable);
    Value product = arith::MulIOp::create(body, loc, variable, step);
    sum = sum ? arith::AddIOp::create(body, loc, sum, product).getResult()
              : product;
  }
  if (!sum)
    sum = arith::ConstantIntOp::create(inner, loc, 0, 32);
  return found->value = sum;
}

Value Nest::writeTree(Value tree, OpBuilder &inner,
                      llvm::DenseMap<Value, Value> &written) {
  if (isAffine(tree))
    return writeLeaf({tree, {}}, inner);
  if (Value known = written.lookup(tree))
    return known;
  Operation *op = tree.getDefiningOp();
  SmallVector<Value> operands;
  for (Value operand : op->getOperands())
    operands.push_back(writeTree(operand, inner, written));
  OperationState state(loc, op->getName(), operands, inner.getI32Type());
  return written[tree] = inner.create(state)->getResult(0);
}

int64_t Nest::narrow() {
  bool isUnsigned = llvm::any_of(
      loops, [](scf::ForOp loop) { return loop.getUnsignedCmp(); });
  if (!isStepOne(row) || isUnsigned)
    return 0;
  outer.walk([&](arith::CmpIOp compare) {
    if (std::optional<SignTest> test = matchTest(compare))
      tests.push_back(*test);
  });
  if (tests.empty())
    return 0;
  for (const SignTest &test : tests)
    test.tree ? collectLeaves(test.tree) : prepare(test.leaf);
  auto choice = scf::IfOp::create(builder, loc, outer.getResultTypes(), fits,
                                  /*addThenBlock=*/true, /*addElseBlock=*/true);
  IRMapping mapping;
  auto fill = [&](Block *block, Operation *loop) {
    if (!block->empty())
      block->getTerminator()->erase();
    OpBuilder end = OpBuilder::atBlockEnd(block);
    if (loop != outer)
      end.insert(loop);
    scf::YieldOp::create(end, loc, loop->getResults());
  };
  Operation *copy = outer->clone(mapping);
  fill(choice.thenBlock(), copy);
  for (scf::ForOp loop : loops)
    made.push_back(loop == outer
                       ? cast<scf::ForOp>(copy)
                       : cast<scf::ForOp>(mapping.lookup(loop.getInductionVar())
                                              .getParentBlock()
                                              ->getParentOp()));
  for (SignTest &test : tests) {
    Operation *compare =
        mapping.lookup(test.compare.getResult()).getDefiningOp();
    OpBuilder inner(compare);
    llvm::DenseMap<Value, Value> written;
    Value value = test.tree ? writeTree(test.tree, inner, written)
                            : writeLeaf(test.leaf, inner);
    Value zero = arith::ConstantIntOp::create(inner, loc, 0, 32);
    using P = arith::CmpIPredicate;
    compare->getResult(0).replaceAllUsesWith(arith::CmpIOp::create(
        inner, loc, test.isNegative ? P::slt : P::sge, value, zero));
    compare->erase();
  }
  // The wide version is the old one.
  outer->replaceAllUsesWith(choice.getResults());
  Block *otherwise = choice.elseBlock();
  if (!otherwise->empty())
    otherwise->getTerminator()->erase();
  outer->moveBefore(otherwise, otherwise->end());
  OpBuilder end = OpBuilder::atBlockEnd(otherwise);
  scf::YieldOp::create(end, loc, outer.getResults());
  return tests.size();
}

void NarrowIntegersPass::runOnOperation() {
  SmallVector<scf::ForOp> rows;
  getOperation().walk([&](scf::ForOp loop) {
    // Loops that stay scalar gain nothing.
    bool mayBeLanes =
        !isOverBox(loop) || hasSpecifiedLanes(loop, LaneMapping::Iterations);
    if (loop->hasAttr(marks::lanes) && !loop->hasAttr(marks::mapping) &&
        mayBeLanes)
      rows.push_back(loop);
  });
  for (scf::ForOp row : rows) {
    // So that what is the same for all pixels stands in front.
    moveLoopInvariantCode(cast<LoopLikeOpInterface>(row.getOperation()));
    if (auto parent = dyn_cast<LoopLikeOpInterface>(row->getParentOp()))
      moveLoopInvariantCode(parent);
    narrowed += Nest(row).narrow();
  }
}
