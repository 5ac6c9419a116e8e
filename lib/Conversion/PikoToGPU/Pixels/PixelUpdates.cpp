// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The updates of covered pixels, in the order of primitives, and what is done
// with the rare primitive after them. Which pixels those are,
// CollapsedPixels.cpp finds.

#include "PikoToGPU/Pixels/PixelGroups.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Math/IR/Math.h"

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

/// Takes a pixel off the list: its number, and which primitives of the group,
/// up to a rare one, have it.
std::pair<Value, Value> CollapsedPixels::takePixel(Emitter &b, Value at) {
  Type i64 = b.getI64Type();
  Value pixel = arith::ExtUIOp::create(b, b.getI32Type(), b.load(list, at));
  Value mask, zero = b.number(0);
  for (int64_t word = 0; word < words; ++word) {
    Value place = pixel;
    if (words > 1)
      place = b.add(b.shl(pixel, b.number(1)), b.number(word));
    Value bits = arith::ExtUIOp::create(b, i64, b.load(masks, place));
    mask = mask ? b.either(mask, b.shl(bits, b.number(i64, 32))) : bits;
    b.store(zero, masks, place);
  }
  if (words > 1)
    b.store(zero, touched, b.shr(pixel, b.number(5)));
  Value one = b.number(i64, 1), end = b.loadAgain(until);
  Value shift = arith::ExtUIOp::create(b, i64, end);
  Value below = b.sub(b.shl(one, shift), one);
  Value isAll = b.is(end, Predicate::sge, b.number(64));
  return {pixel, b.both(mask, b.select(isAll, b.number(i64, -1), below))};
}

/// Each thread has some pixels of the list, and takes bit after bit of them, so
/// that a warp waits for the longest sum of bits, and not for that of each
/// pixel.
void CollapsedPixels::updatePixels(Emitter &b) {
  Value size = b.load(listed, b.number(0));
  Type i32 = b.getI32Type(), i64 = b.getI64Type();
  Emitter one = b.when(b.is(thread, Predicate::eq, b.number(0)));
  one.store(one.number(0), ticket, one.number(0));
  one.store(one.number(group), limit, one.number(0));

  Value none = b.number(i64, 0);
  auto loop = scf::WhileOp::create(
      b, TypeRange{i32, i32, i64}, ValueRange{thread, b.number(0), none},
      [&](OpBuilder &at, Location loc, ValueRange now) {
        Value rest =
            arith::CmpIOp::create(at, loc, Predicate::ne, now[2], none);
        Value more =
            arith::CmpIOp::create(at, loc, Predicate::slt, now[0], size);
        more = arith::OrIOp::create(at, loc, rest, more);
        scf::ConditionOp::create(at, loc, more, now);
      },
      [&](OpBuilder &at, Location loc, ValueRange now) {
        Emitter in(loc, at.getInsertionBlock(), at.getInsertionPoint());
        auto fetch = scf::IfOp::create(in, TypeRange{i32, i32, i64},
                                       in.is(now[2], Predicate::eq, none),
                                       /*withElseRegion=*/true);
        Emitter taken(loc, fetch.thenBlock(), fetch.thenBlock()->end());
        auto [pixel, mask] = takePixel(taken, now[0]);
        Value next = taken.add(now[0], taken.number(threads));
        scf::YieldOp::create(taken, ValueRange{next, pixel, mask});
        Emitter kept(loc, fetch.elseBlock(), fetch.elseBlock()->end());
        scf::YieldOp::create(kept, now);
        mask = fetch.getResult(2);
        // Only a rare primitive leaves none.
        Emitter work = in.when(in.is(mask, Predicate::ne, none));
        updatePixel(work, fetch.getResult(1),
                    math::CountTrailingZerosOp::create(work, mask));
        Value less = in.both(mask, in.sub(mask, in.number(i64, 1)));
        scf::YieldOp::create(
            in, ValueRange{fetch.getResult(0), fetch.getResult(1), less});
      });
  (void)loop;
}

void CollapsedPixels::updatePixel(Emitter &b, Value pixel, Value bit) {
  Value item = b.toIndex(bit);
  memory.setPosition(b, b.add(base, item));
  IRMapping mapping;
  mapping.map(items.getInductionVar(), item);
  SmallVector<Value> cell;
  for (int64_t extent : stage.getBins()) {
    Value size = b.number(extent);
    Type type = binLo[cell.size()].getType();
    Value at = arith::RemUIOp::create(b, pixel, size);
    cell.push_back(b.add(binLo[cell.size()], b.fromNumber(at, type)));
    pixel = arith::DivUIOp::create(b, pixel, size);
  }
  mapCounters(mapping, cell);
  for (auto [block, next] : nest.levels)
    cloneUntil(b, block, next, mapping);
  cloneUntil(b, nest.work, nest.work->getTerminator(), mapping);
}

/// The group's rare primitive, if it has one; returns where the next group
/// begins.
Value CollapsedPixels::runRare(Emitter &b) {
  Value zero = b.number(0);
  Emitter one = b.when(b.is(thread, Predicate::eq, zero));
  one.store(zero, listed, zero);
  Value end = b.loadAgain(until);
  Value isRare = b.is(end, Predicate::slt, b.number(group));
  Value position = b.add(base, b.toIndex(end));
  Value next = b.select(isRare, b.add(position, b.index(1)),
                        b.add(base, b.index(group)));
  Emitter in = b.when(isRare);
  site.branch = cast<scf::IfOp>(in.getInsertionBlock()->getParentOp());
  site.position = position;
  site.next = next.getDefiningOp();
  Emitter body = in;
  if (isRareForOne)
    body = in.when(in.is(thread, Predicate::eq, zero));
  rare->moveBefore(&*body.getInsertionPoint());
  rare.setLowerBound(position);
  body.setInsertionPoint(rare);
  // Not known to be one, so that it stays a loop until it is outlined.
  rare.setUpperBound(arith::MinSIOp::create(body, next, items.getUpperBound()));
  rare->setAttr(marks::rare, b.getUnitAttr());
  OpBuilder inside = OpBuilder::atBlockBegin(rare.getBody());
  memory.setPosition(inside, rare.getInductionVar());
  in.setInsertionPoint(in.getInsertionBlock()->getTerminator());
  in.barrier();
  return next;
}
