// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which signs and values of a loop over pixels may be narrow, and what has to
// be tested for that.
//
// A sign is that of a function, or of bits, minima and maxima of several.
// Functions are divided by the power of two that all their steps are multiples
// of, and rounded down, which changes no sign. One that becomes a float, as a
// weight does, is needed with all bits: it is the function whose sign is taken,
// shifted back, plus what the bits below were, if both have the same steps. So
// a bias for points on an edge does not matter.

#include "Narrowing/Narrower.h"

#include "Narrowing/RowStrips.h"

#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// What may be narrow
//===----------------------------------------------------------------------===//

bool Narrower::isTree(Value value) {
  if (nest.isAffine(value))
    return true;
  if (auto known = trees.find(value); known != trees.end())
    return known->second;
  Operation *op = value.getDefiningOp();
  return trees[value] = op && nest.getOuter()->isProperAncestor(op) &&
                        isa<arith::OrIOp, arith::AndIOp, arith::XOrIOp,
                            arith::MaxSIOp, arith::MinSIOp>(op) &&
                        isTree(op->getOperand(0)) && isTree(op->getOperand(1));
}

std::optional<Narrower::SignTest> Narrower::matchTest(arith::CmpIOp compare) {
  using P = arith::CmpIPredicate;
  P predicate = compare.getPredicate();
  Value lhs = compare.getLhs(), rhs = compare.getRhs();
  bool isSigned = predicate == P::slt || predicate == P::sle ||
                  predicate == P::sgt || predicate == P::sge;
  bool isNarrow = lhs.getType().isInteger(32);
  if (!isSigned || (isNarrow ? !mayHaveStrips : !lhs.getType().isInteger(64)) ||
      (nest.isInvariant(lhs) && nest.isInvariant(rhs)))
    return {};
  APInt bound;
  bool isSign =
      matchPattern(rhs, m_ConstantInt(&bound)) &&
      ((bound.isZero() && (predicate == P::slt || predicate == P::sge)) ||
       (bound.isAllOnes() && (predicate == P::sgt || predicate == P::sle)));
  if (isSign && isTree(lhs))
    return SignTest{
        compare, predicate == P::slt || predicate == P::sle, lhs, {}};
  if (!nest.isAffine(lhs) || !nest.isAffine(rhs))
    return {};
  // a > b is b - a < 0; a <= b is b - a >= 0.
  bool isTurned = predicate == P::sgt || predicate == P::sle;
  return SignTest{compare,
                  predicate == P::slt || predicate == P::sgt,
                  {},
                  isTurned ? Leaf{rhs, lhs} : Leaf{lhs, rhs}};
}

/// Whether an affine function of the column is converted: one of the row alone
/// is no vector.
bool Narrower::isVarying(arith::SIToFPOp op) {
  Value value = op.getIn();
  return value.getType().isInteger(64) && !nest.isInvariant(value) &&
         nest.isAffine(value) &&
         nest.expand(value).coefficients[nest.getLoops().size() - 1];
}

//===----------------------------------------------------------------------===//
// Before the loops
//===----------------------------------------------------------------------===//

Value piko::cutTo32(OpBuilder &builder, Location loc, Value number) {
  Type narrow = builder.getI32Type();
  if (number.getType().isIndex())
    return arith::IndexCastOp::create(builder, loc, narrow, number);
  if (number.getType() != narrow)
    return arith::TruncIOp::create(builder, loc, narrow, number);
  return number;
}

Affine Narrower::getAffine(const Leaf &leaf) {
  Affine a = nest.expand(leaf.plus);
  return leaf.minus ? nest.subtract(a, nest.expand(leaf.minus)) : a;
}

size_t Narrower::prepare(const Leaf &leaf, Value &fits) {
  auto *known =
      llvm::find_if(leaves, [&](const Narrow &n) { return n.leaf == leaf; });
  if (known != leaves.end())
    return known - leaves.begin();
  // What a difference is made of must not overflow, either.
  bool isNarrow = leaf.plus.getType().isInteger(32);
  if (leaf.minus)
    for (Value part : {leaf.plus, leaf.minus}) {
      Affine affine = nest.expand(part);
      if (!isNarrow)
        nest.shiftDown(affine);
      nest.addCheck(affine, fits);
    }
  Narrow narrow{leaf, getAffine(leaf), {}, 0, {}, {}, {}};
  narrow.shifted = narrow.whole;
  narrow.zeros = isNarrow ? 0 : nest.shiftDown(narrow.shifted);
  narrow.range = nest.addCheck(narrow.shifted, fits);
  auto cutOne = [&](Value value) {
    return value ? cutTo32(nest.builder, nest.loc, value) : value;
  };
  narrow.base = cutOne(narrow.shifted.base);
  narrow.steps = {cutOne(narrow.shifted.coefficients[0]),
                  cutOne(narrow.shifted.coefficients[1])};
  leaves.push_back(narrow);
  return leaves.size() - 1;
}

void Narrower::collectLeaves(Value tree) {
  if (!collected.insert(tree).second)
    return;
  if (nest.isAffine(tree)) {
    prepare({tree, {}}, signsFit);
    return;
  }
  for (Value operand : tree.getDefiningOp()->getOperands())
    collectLeaves(operand);
}

/// Tests whether a function fits with all of its bits. Where a leaf has the
/// same steps, as if one is the other with a bias for points on the edge, the
/// function is that leaf and a number.
void Narrower::prepareConversion(arith::SIToFPOp op) {
  Affine affine = nest.expand(op.getIn());
  auto *same = llvm::find_if(leaves, [&](const Narrow &n) {
    return n.whole.coefficients == affine.coefficients;
  });
  Conversion conversion{op, size_t(same - leaves.begin()), {}};
  if (same == leaves.end()) {
    // No sign of it is needed, so that nothing has tested it.
    conversion.leaf = prepare({op.getIn(), {}}, valuesFit);
    same = &leaves[conversion.leaf];
  }
  OpBuilder &builder = nest.builder;
  Value by = nest.makeConstant(same->zeros);
  auto shift = [&](Value value) -> Value {
    return value
               ? arith::ShLIOp::create(builder, nest.loc, value, by).getResult()
               : value;
  };
  Value rest = nest.getTwo(false, affine.base, shift(same->shifted.base));
  for (Value extreme : {same->range.least, same->range.most})
    nest.require(nest.getTwo(true, shift(extreme), rest), 32, valuesFit);
  if (rest)
    conversion.rest = cutTo32(builder, nest.loc, rest);
  conversions.push_back(conversion);
}

//===----------------------------------------------------------------------===//
// What bounds the rows of strips
//===----------------------------------------------------------------------===//

void Narrower::requireTree(Value tree, bool isNegative) {
  if (nest.isAffine(tree)) {
    required.push_back({prepare({tree, {}}, signsFit), isNegative});
    return;
  }
  Operation *op = tree.getDefiningOp();
  bool areBoth = isNegative ? isa<arith::AndIOp, arith::MaxSIOp>(op)
                            : isa<arith::OrIOp, arith::MinSIOp>(op);
  if (areBoth)
    for (Value operand : op->getOperands())
      requireTree(operand, isNegative);
}

/// What has to be where a condition holds.
void Narrower::requireCondition(Value condition) {
  Operation *op = condition.getDefiningOp();
  auto choice = dyn_cast_or_null<arith::SelectOp>(op);
  bool isBoth = choice && matchPattern(choice.getFalseValue(), m_Zero());
  if (isBoth || isa_and_nonnull<arith::AndIOp>(op)) {
    requireCondition(op->getOperand(0));
    requireCondition(op->getOperand(1));
    return;
  }
  auto *test = llvm::find_if(
      tests, [&](const SignTest &test) { return test.compare == op; });
  if (test == tests.end())
    return;
  if (test->tree)
    requireTree(test->tree, test->isNegative);
  else
    required.push_back({prepare(test->leaf, signsFit), test->isNegative});
}

/// Of a block that does nothing but what stands under one condition, what that
/// takes.
void Narrower::findRequired(Block &block) {
  scf::IfOp only;
  for (Operation &op : block.without_terminator()) {
    if (isPure(&op))
      continue;
    auto choice = dyn_cast<scf::IfOp>(op);
    if (only || !choice || choice.getNumResults() > 0 || choice.elseBlock())
      return;
    only = choice;
  }
  if (!only)
    return;
  requireCondition(only.getCondition());
  findRequired(*only.thenBlock());
}

//===----------------------------------------------------------------------===//
// All of a loop
//===----------------------------------------------------------------------===//

void Narrower::findConversions() {
  // A third version of much code costs more than wide values in it.
  constexpr int64_t most = 200;
  SmallVector<arith::SIToFPOp> found;
  int64_t length = 0;
  nest.getOuter().walk([&](Operation *op) {
    ++length;
    auto conversion = dyn_cast<arith::SIToFPOp>(op);
    if (conversion && isVarying(conversion))
      found.push_back(conversion);
  });
  for (arith::SIToFPOp op : found) {
    if (length <= most) {
      prepareConversion(op);
      continue;
    }
    op.emitRemark("this number is converted from 64 bits, though 32 may hold "
                  "it: its loop has ")
        << length << " operations, and is copied up to " << most;
  }
}

void Narrower::narrow() {
  scf::ForOp outer = nest.getOuter();
  bool isUnsigned = llvm::any_of(
      nest.getLoops(), [](scf::ForOp loop) { return loop.getUnsignedCmp(); });
  if (!matchPattern(nest.getRow().getStep(), m_One()) || isUnsigned)
    return;
  mayHaveStrips = stripWidth != 0 && nest.getLoops().size() == 2 &&
                  canInterchange(outer, nest.getRow());
  outer.walk([&](arith::CmpIOp compare) {
    if (std::optional<SignTest> test = matchTest(compare))
      tests.push_back(*test);
  });
  for (const SignTest &test : tests) {
    if (test.tree)
      collectLeaves(test.tree);
    else
      prepare(test.leaf, signsFit);
  }
  signLeaves = leaves.size();
  findConversions();
  if (mayHaveStrips) {
    findRequired(*nest.getRow().getBody());
    // Of what bounds are upright, rows are as full as strips, and lie in order.
    if (llvm::none_of(required, [&](RequiredSign sign) {
          return leaves[sign.leaf].steps[0] && leaves[sign.leaf].steps[1];
        }))
      required.clear();
  }
  if (comparisons() == 0 && conversions.empty() && required.empty()) {
    tests.clear();
    return;
  }
  if (comparisons() != 0 || !conversions.empty())
    outer.emitRemark("where they fit, ")
        << comparisons() << " comparisons and " << conversions.size()
        << " conversions of these iterations take 32 bits instead of 64";
  if (!required.empty())
    outer.emitRemark("where they fit into 32 bits, ")
        << required.size() << " comparisons bound the rows of each strip of "
        << stripWidth << " columns";
  makeVersions();
}
