// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Versions of a loop over pixels, in which functions of the pixel have 32 bits:
// twice as many lanes, and no multiplication of 64 bits.
//
// What a row begins with is carried from the row before: how many vectors a row
// has is seldom predicted, and a product is then waited for. A box that lies
// outside of a half-plane, by what was evaluated at its corners, has no strips.

#include "Narrowing/Narrower.h"

#include "Narrowing/RowStrips.h"
#include "Vectorize/Analysis/Lanes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/IR/PatternMatch.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Inside
//===----------------------------------------------------------------------===//

/// The sum of two, of which the first may be null, for 0.
static Value add(OpBuilder &builder, Location loc, Value a, Value b) {
  return a ? arith::AddIOp::create(builder, loc, a, b).getResult() : b;
}

/// base + step * row, carried from row to row: the number of pixels of a row is
/// seldom predicted, and what the next one begins with is then waited for.
static Value carryOverRows(scf::ForOp &rows, Value base, Value step) {
  Location loc = rows.getLoc();
  IRRewriter rewriter(rows);
  Value lower = cutTo32(rewriter, loc, rows.getLowerBound());
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
    Value variable = cutTo32(body, loc, loop.getInductionVar());
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
// Versions
//===----------------------------------------------------------------------===//

/// Ends a block with a loop, and with what it yields.
static void finish(Block *block, Operation *loop) {
  if (!block->empty())
    block->getTerminator()->erase();
  loop->remove();
  block->push_back(loop);
  OpBuilder end = OpBuilder::atBlockEnd(block);
  // Nobody uses what rows hand on that may be visited in any order.
  ValueRange results;
  if (block->getParentOp()->getNumResults() != 0)
    results = loop->getResults();
  scf::YieldOp::create(end, loop->getLoc(), results);
}

Narrower::Version Narrower::copy(Block *into) {
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
  TypeRange results;
  if (required.empty())
    results = nest.getOuter().getResultTypes();
  return scf::IfOp::create(nest.builder, nest.loc, results, fits,
                           /*addThenBlock=*/true, /*addElseBlock=*/true);
}

/// Whether the box reaches into all half-planes: two of five boxes of triangles
/// that are larger than bins do not. Null where there are none.
Value Narrower::testReach() {
  OpBuilder &builder = nest.builder;
  Value isReached, zero = nest.makeConstant(0);
  for (RequiredSign sign : required) {
    const AffineNest::Range &range = leaves[sign.leaf].range;
    using P = arith::CmpIPredicate;
    Value reaches = arith::CmpIOp::create(
        builder, nest.loc, sign.isNegative ? P::slt : P::sge,
        sign.isNegative ? range.least : range.most, zero);
    isReached =
        isReached ? arith::AndIOp::create(builder, nest.loc, isReached, reaches)
                        .getResult()
                  : reaches;
  }
  return isReached;
}

/// Enters a condition.
Block *Narrower::enter(Block *block, Value condition) {
  auto made = scf::IfOp::create(nest.builder, nest.loc, condition,
                                /*withElseRegion=*/false);
  finish(block, made);
  return made.thenBlock();
}

// Values fit less often than signs, which are divided.
void Narrower::makeVersions() {
  scf::ForOp outer = nest.getOuter();
  Value isReached = testReach();
  scf::IfOp choice = choose(tests.empty() ? valuesFit : signsFit);
  Block *narrowest = choice.thenBlock();
  if (isReached)
    narrowest = enter(narrowest, isReached);
  if (!tests.empty() && !conversions.empty()) {
    scf::IfOp inner = choose(valuesFit);
    finish(narrowest, inner);
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
  if (choice.getNumResults() != 0)
    outer->replaceAllUsesWith(choice.getResults());
  finish(choice.elseBlock(), outer);
}

/// Whether lanes may be primitives, to each of which all of this is done.
static bool mayBeInLanes(Operation *loop) {
  for (auto parent = loop->getParentOfType<scf::ForOp>(); parent;
       parent = parent->getParentOfType<scf::ForOp>())
    if (parent->hasAttr(marks::lanes) &&
        getLaneMapping(parent) != LaneMapping::Iterations)
      return true;
  return false;
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
  // As many as a vector has rows, which are f64.
  int64_t group = mayBeInLanes(nest.getOuter()) ? 1 : (stripWidth + 1) / 2;
  interchange(version.loops.front(), version.loops.back(), planes, stripWidth,
              group);
}
