// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-narrow-integers: signs and values of affine functions of a pixel in 32
// bits, where a test in front of the loop finds that they fit.

#include "AffineNest.h"
#include "Lanes.h"
#include "RowStrips.h"

#include "Piko/Transforms/Passes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Transforms/LoopInvariantCodeMotionUtils.h"

namespace piko {
#define GEN_PASS_DEF_NARROWINTEGERS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct NarrowIntegersPass : piko::impl::NarrowIntegersBase<NarrowIntegersPass> {
  using NarrowIntegersBase::NarrowIntegersBase;
  void runOnOperation() override;
};

/// A function of the pixel whose sign or value matters, as a difference if
/// there is a second one.
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

/// What a leaf is in 32 bits, without the bits below its steps.
struct Narrow {
  Leaf leaf;
  Affine whole;            ///< with these bits
  Affine shifted;          ///< without, but in 64 bits
  unsigned zeros;          ///< how many they are
  AffineNest::Range range; ///< of `shifted`
  Value base;
  std::array<Value, 2> steps;
};

/// A function that becomes a floating-point number, hence is needed with all of
/// its bits: narrow << its zeros, plus what is the same for all pixels.
struct Conversion {
  arith::SIToFPOp op;
  size_t leaf;
  Value rest; ///< null if the leaf is the function itself
};

/// A copy of the loops, in which values are narrow.
struct Version {
  IRMapping mapping;
  SmallVector<scf::ForOp, 2> loops;
  llvm::DenseMap<size_t, Value> leaves;
};

/// A leaf without whose sign a pixel has nothing to do.
struct RequiredSign {
  size_t leaf;
  bool isNegative;
};

/// The comparisons and conversions of a loop over pixels.
class Narrower {
public:
  /// With strips of so many columns, or none if 0.
  Narrower(scf::ForOp row, int64_t stripWidth)
      : nest(row), stripWidth(stripWidth) {}

  /// Makes further versions of the loops, as far as there is a use.
  void narrow();

  /// Of 64 bits.
  int64_t comparisons() const {
    return llvm::count_if(tests, [](SignTest test) {
      return test.compare.getLhs().getType().isInteger(64);
    });
  }
  int64_t values() const { return conversions.size(); }
  bool areInterchanged() const { return !required.empty(); }

private:
  bool isTree(Value value);
  std::optional<SignTest> matchTest(arith::CmpIOp compare);
  bool isVarying(arith::SIToFPOp op);
  Affine getAffine(const Leaf &leaf);
  /// The number of a leaf, which is new if `fits` is extended by its test.
  size_t prepare(const Leaf &leaf, Value &fits);
  void collectLeaves(Value tree);
  void prepareConversion(arith::SIToFPOp op);

  void findConversions();

  void findRequired(Block &block);
  void requireCondition(Value condition);
  void requireTree(Value tree, bool isNegative);
  void makeStrips(Version &version);

  scf::IfOp choose(Value fits);
  void makeVersions();
  Version copy(Block *into);
  void narrowTests(Version &version);
  void narrowConversions(Version &version);
  Value writeLeaf(size_t number, Version &version);
  /// `written` has what this comparison has already.
  Value writeTree(Value tree, OpBuilder &inner, Version &version,
                  llvm::DenseMap<Value, Value> &written);

  AffineNest nest;
  SmallVector<SignTest> tests;
  SmallVector<Conversion> conversions;
  SmallVector<Narrow> leaves;
  SmallVector<RequiredSign> required; ///< none where there are no strips
  int64_t stripWidth;
  bool mayHaveStrips = false;
  size_t signLeaves = 0; ///< The first ones, which comparisons need.
  llvm::DenseMap<Value, bool> trees;
  llvm::DenseSet<Value> collected;
  Value signsFit, valuesFit;
};

} // namespace

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

std::optional<SignTest> Narrower::matchTest(arith::CmpIOp compare) {
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
// In front of the loops
//===----------------------------------------------------------------------===//

/// A number in 32 bits.
static Value cut(OpBuilder &builder, Location loc, Value number) {
  Type narrow = builder.getI32Type();
  if (number.getType().isIndex())
    return arith::IndexCastOp::create(builder, loc, narrow, number);
  if (number.getType() != narrow)
    return arith::TruncIOp::create(builder, loc, narrow, number);
  return number;
}

/// The sum of two, of which the first may be null, for 0.
static Value add(OpBuilder &builder, Location loc, Value a, Value b) {
  return a ? arith::AddIOp::create(builder, loc, a, b).getResult() : b;
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
    return value ? cut(nest.builder, nest.loc, value) : value;
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
    conversion.rest = cut(builder, nest.loc, rest);
  conversions.push_back(conversion);
}

//===----------------------------------------------------------------------===//
// Inside
//===----------------------------------------------------------------------===//

/// base + step * row, carried from row to row: the number of pixels of a row is
/// seldom predicted, and what the next one begins with is then waited for.
static Value carryOverRows(scf::ForOp &rows, Value base, Value step) {
  Location loc = rows.getLoc();
  IRRewriter rewriter(rows);
  Value lower = cut(rewriter, loc, rows.getLowerBound());
  Value first = add(rewriter, loc, base,
                    arith::MulIOp::create(rewriter, loc, lower, step));
  NamedAttrList marks(rows->getDiscardableAttrDictionary());
  auto made = cast<scf::ForOp>(*rows.replaceWithAdditionalYields(
      rewriter, first, /*replaceInitOperandUsesInLoop=*/false,
      [&](OpBuilder &end, Location loc, ArrayRef<BlockArgument> arguments) {
        return SmallVector<Value>{
            arith::AddIOp::create(end, loc, arguments.back(), step)};
      }));
  made->setDiscardableAttrs(marks.getDictionary(made.getContext()));
  rows = made;
  return made.getRegionIterArgs().back();
}

Value Narrower::writeLeaf(size_t number, Version &version) {
  Value &written = version.leaves[number];
  if (written)
    return written;
  // Modulo 2^32, which is exact, for the result fits.
  Location loc = nest.loc;
  Value sum = leaves[number].base;
  for (auto [loop, step] : llvm::zip(version.loops, leaves[number].steps)) {
    if (!step)
      continue;
    if (loop != version.loops.back()) {
      // What others carry are arguments of the loop that is made anew.
      SmallVector<std::pair<size_t, unsigned>> carried;
      for (auto [other, value] : version.leaves)
        if (auto argument = dyn_cast_or_null<BlockArgument>(value))
          carried.push_back({other, argument.getArgNumber()});
      sum = carryOverRows(loop, sum, step);
      for (auto [other, argument] : carried)
        version.leaves[other] = loop.getBody()->getArgument(argument);
      continue;
    }
    OpBuilder body = OpBuilder::atBlockBegin(loop.getBody());
    Value variable = cut(body, loc, loop.getInductionVar());
    sum = add(body, loc, sum, arith::MulIOp::create(body, loc, variable, step));
  }
  if (!sum) {
    OpBuilder front(version.loops.front());
    sum = arith::ConstantIntOp::create(front, loc, 0, 32);
  }
  return written = sum;
}

Value Narrower::writeTree(Value tree, OpBuilder &inner, Version &version,
                          llvm::DenseMap<Value, Value> &written) {
  if (nest.isAffine(tree))
    return writeLeaf(prepare({tree, {}}, signsFit), version);
  if (Value known = written.lookup(tree))
    return known;
  Operation *op = tree.getDefiningOp();
  SmallVector<Value> operands;
  for (Value operand : op->getOperands())
    operands.push_back(writeTree(operand, inner, version, written));
  OperationState state(nest.loc, op->getName(), operands, inner.getI32Type());
  return written[tree] = inner.create(state)->getResult(0);
}

void Narrower::narrowTests(Version &version) {
  // First all leaves: where one is carried, the loop is made anew.
  for (size_t leaf = 0; leaf < signLeaves; ++leaf)
    writeLeaf(leaf, version);
  for (SignTest &test : tests) {
    Operation *compare =
        version.mapping.lookup(test.compare.getResult()).getDefiningOp();
    OpBuilder inner(compare);
    llvm::DenseMap<Value, Value> written;
    Value value = test.tree ? writeTree(test.tree, inner, version, written)
                            : writeLeaf(prepare(test.leaf, signsFit), version);
    Value zero = arith::ConstantIntOp::create(inner, nest.loc, 0, 32);
    using P = arith::CmpIPredicate;
    compare->getResult(0).replaceAllUsesWith(arith::CmpIOp::create(
        inner, nest.loc, test.isNegative ? P::slt : P::sge, value, zero));
    compare->erase();
  }
}

void Narrower::narrowConversions(Version &version) {
  for (Conversion &conversion : conversions) {
    auto op = version.mapping.lookup(conversion.op.getResult())
                  .getDefiningOp<arith::SIToFPOp>();
    Value value = writeLeaf(conversion.leaf, version);
    OpBuilder inner(op);
    if (unsigned zeros = leaves[conversion.leaf].zeros) {
      Value by = arith::ConstantIntOp::create(inner, nest.loc, zeros, 32);
      value = arith::ShLIOp::create(inner, nest.loc, value, by);
    }
    if (conversion.rest)
      value = arith::AddIOp::create(inner, nest.loc, value, conversion.rest);
    op.getInMutable().assign(value);
  }
}

//===----------------------------------------------------------------------===//
// Strips
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

/// Of a block that does nothing but what stands behind one condition, what that
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

void Narrower::makeStrips(Version &version) {
  if (required.empty())
    return;
  SmallVector<HalfPlane> planes;
  for (RequiredSign sign : required) {
    const Narrow &leaf = leaves[sign.leaf];
    planes.push_back(
        {leaf.base, leaf.steps[0], leaf.steps[1], sign.isNegative});
  }
  interchange(version.loops.front(), version.loops.back(), planes, stripWidth);
}

//===----------------------------------------------------------------------===//
// Versions
//===----------------------------------------------------------------------===//

/// Ends a block with a loop, and with what it yields.
static void finish(Block *block, Operation *loop) {
  if (!block->empty())
    block->getTerminator()->erase();
  loop->remove();
  block->push_back(loop);
  OpBuilder end = OpBuilder::atBlockEnd(block);
  scf::YieldOp::create(end, loop->getLoc(), loop->getResults());
}

Version Narrower::copy(Block *into) {
  Version version;
  scf::ForOp outer = nest.getOuter();
  Operation *made = nest.builder.clone(*outer, version.mapping);
  finish(into, made);
  for (scf::ForOp loop : nest.getLoops())
    version.loops.push_back(
        loop == outer
            ? cast<scf::ForOp>(made)
            : cast<scf::ForOp>(version.mapping.lookup(loop.getInductionVar())
                                   .getParentBlock()
                                   ->getParentOp()));
  return version;
}

scf::IfOp Narrower::choose(Value fits) {
  return scf::IfOp::create(nest.builder, nest.loc,
                           nest.getOuter().getResultTypes(), fits,
                           /*addThenBlock=*/true, /*addElseBlock=*/true);
}

// Values fit less often than signs, which are divided.
void Narrower::makeVersions() {
  scf::ForOp outer = nest.getOuter();
  scf::IfOp choice = choose(tests.empty() ? valuesFit : signsFit);
  Block *narrowest = choice.thenBlock();
  if (!tests.empty() && !conversions.empty()) {
    scf::IfOp inner = choose(valuesFit);
    finish(choice.thenBlock(), inner);
    Version signs = copy(inner.elseBlock());
    narrowTests(signs);
    makeStrips(signs);
    narrowest = inner.thenBlock();
  }
  Version version = copy(narrowest);
  narrowTests(version);
  narrowConversions(version);
  makeStrips(version);
  // The wide version is the old one.
  outer->replaceAllUsesWith(choice.getResults());
  finish(choice.elseBlock(), outer);
}

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

/// Moves out of a loop what it reads of local arrays that it does not change,
/// at places that are known.
static void hoistLoads(scf::ForOp loop) {
  SmallVector<memref::LoadOp> loads;
  loop.walk([&](memref::LoadOp load) {
    auto array = load.getMemRef().getDefiningOp<memref::AllocaOp>();
    if (!array || loop->isAncestor(array))
      return;
    bool isInside =
        llvm::all_of(llvm::zip(load.getIndices(), array.getType().getShape()),
                     [](auto pair) {
                       std::optional<int64_t> at =
                           getConstantIntValue(std::get<0>(pair));
                       return at && *at >= 0 && *at < std::get<1>(pair);
                     });
    bool isRead = llvm::all_of(array->getUsers(), [&](Operation *user) {
      return isa<memref::LoadOp>(user) ||
             (isa<memref::StoreOp>(user) && !loop->isAncestor(user));
    });
    if (isInside && isRead)
      loads.push_back(load);
  });
  for (memref::LoadOp load : loads) {
    for (Value index : load.getIndices())
      if (!loop.isDefinedOutsideOfLoop(index))
        index.getDefiningOp()->moveBefore(loop);
    load->moveBefore(loop);
  }
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
    hoistLoads(row);
    moveLoopInvariantCode(cast<LoopLikeOpInterface>(row.getOperation()));
    if (auto parent = dyn_cast<LoopLikeOpInterface>(row->getParentOp())) {
      if (auto rows = dyn_cast<scf::ForOp>(row->getParentOp()))
        hoistLoads(rows);
      moveLoopInvariantCode(parent);
    }
    Narrower narrower(row, laneCount);
    narrower.narrow();
    comparisons += narrower.comparisons();
    values += narrower.values();
    interchanged += narrower.areInterchanged();
  }
}
