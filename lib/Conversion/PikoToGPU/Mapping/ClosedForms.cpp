// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Closed forms of recurrences. A loop over pixels often steps a number from one
// pixel to the next: an edge function, a gradient. That makes each iteration
// depend on the one before it. Of an integer to which each iteration adds the
// same, the value of iteration i is
//
//   first + i * step
//
// with the same bits, because integers wrap; and threads can take iterations in
// any order.

#include "PikoToGPU/Mapping/PixelNest.h"

#include "mlir/Dialect/Utils/StaticValueUtils.h"
#include "llvm/ADT/BitVector.h"

using namespace mlir;
using namespace piko;

namespace {
/// What a loop adds to a number that it hands on.
struct Recurrence {
  Value step;
  bool isSubtracted;
};
} // namespace

static std::optional<Recurrence> matchRecurrence(scf::ForOp loop, unsigned i) {
  Value before = loop.getRegionIterArg(i);
  Operation *op = loop.getYieldedValues()[i].getDefiningOp();
  if (!isa_and_nonnull<arith::AddIOp, arith::SubIOp>(op))
    return std::nullopt;
  bool subtracts = isa<arith::SubIOp>(op);
  Value step = op->getOperand(1);
  if (op->getOperand(0) != before) {
    if (subtracts || step != before)
      return std::nullopt;
    step = op->getOperand(0);
  }
  if (!loop.isDefinedOutsideOfLoop(step))
    return std::nullopt;
  return Recurrence{step, subtracts};
}

/// The low bits of a count, which may be wider or narrower.
static Value castCount(OpBuilder &builder, Value count, Type type) {
  Location loc = count.getLoc();
  if (count.getType() == type)
    return count;
  if (count.getType().isIndex() || type.isIndex())
    return arith::IndexCastUIOp::create(builder, loc, type, count);
  if (type.getIntOrFloatBitWidth() < count.getType().getIntOrFloatBitWidth())
    return arith::TruncIOp::create(builder, loc, type, count);
  return arith::ExtUIOp::create(builder, loc, type, count);
}

/// The number after `count` iterations.
static Value createValue(OpBuilder &builder, Value first, Recurrence recurrence,
                         Value count) {
  Location loc = first.getLoc();
  count = castCount(builder, count, first.getType());
  Value change = arith::MulIOp::create(builder, loc, count, recurrence.step);
  if (recurrence.isSubtracted)
    return arith::SubIOp::create(builder, loc, first, change);
  return arith::AddIOp::create(builder, loc, first, change);
}

/// The loop without what it hands on at `dropped`.
static scf::ForOp dropIterArgs(scf::ForOp loop,
                               const llvm::BitVector &dropped) {
  OpBuilder builder(loop);
  SmallVector<Value> inits, yielded;
  for (auto [i, init] : llvm::enumerate(loop.getInitArgs()))
    if (!dropped[i]) {
      inits.push_back(init);
      yielded.push_back(loop.getYieldedValues()[i]);
    }
  auto made = scf::ForOp::create(builder, loop.getLoc(), loop.getLowerBound(),
                                 loop.getUpperBound(), loop.getStep(), inits);
  made->setDiscardableAttrs(loop->getDiscardableAttrDictionary());
  loop.getInductionVar().replaceAllUsesWith(made.getInductionVar());
  unsigned kept = 0;
  for (unsigned i = 0, e = loop.getNumResults(); i < e; ++i)
    if (!dropped[i]) {
      loop.getRegionIterArg(i).replaceAllUsesWith(made.getRegionIterArg(kept));
      loop.getResult(i).replaceAllUsesWith(made.getResult(kept++));
    }
  if (made.getBody()->mightHaveTerminator())
    made.getBody()->getTerminator()->erase();
  loop.getBody()->getTerminator()->erase();
  made.getBody()->getOperations().splice(made.getBody()->end(),
                                         loop.getBody()->getOperations());
  builder.setInsertionPointToEnd(made.getBody());
  scf::YieldOp::create(builder, loop.getLoc(), yielded);
  loop.erase();
  return made;
}

static void useClosedForms(scf::ForOp loop) {
  if (!loop.getNumResults() || loop.getUnsignedCmp() ||
      !isConstantIntValue(loop.getStep(), 1))
    return;
  Location loc = loop.getLoc();
  OpBuilder inside = OpBuilder::atBlockBegin(loop.getBody()), after(loop);
  after.setInsertionPointAfter(loop);
  Value lo = loop.getLowerBound(), hi = loop.getUpperBound(), count, trips;
  llvm::BitVector dropped(loop.getNumResults());
  for (unsigned i = 0, e = loop.getNumResults(); i < e; ++i) {
    auto recurrence = matchRecurrence(loop, i);
    if (!recurrence)
      continue;
    dropped.set(i);
    if (!count)
      count = arith::SubIOp::create(inside, loc, loop.getInductionVar(), lo);
    Value first = loop.getInitArgs()[i];
    loop.getRegionIterArg(i).replaceAllUsesWith(
        createValue(inside, first, *recurrence, count));
    if (loop.getResult(i).use_empty())
      continue;
    if (!trips) {
      Value end = arith::MaxSIOp::create(after, loc, lo, hi);
      trips = arith::SubIOp::create(after, loc, end, lo);
    }
    loop.getResult(i).replaceAllUsesWith(
        createValue(after, first, *recurrence, trips));
  }
  if (dropped.any())
    dropIterArgs(loop, dropped);
}

void piko::useClosedFormsInPixelLoops(Operation *items) {
  SmallVector<scf::ForOp> loops;
  items->getRegion(0).walk<WalkOrder::PreOrder>([&](scf::ForOp loop) {
    if (contains(loop, [](Operation *op) { return isa<UpdateOp>(op); }))
      loops.push_back(loop);
  });
  for (scf::ForOp loop : loops)
    useClosedForms(loop);
}
