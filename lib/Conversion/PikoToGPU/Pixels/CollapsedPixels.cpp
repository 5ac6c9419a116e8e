// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Collapses the pixels of a group of primitives into one space that the threads
// of a block share, where each primitive has a box of pixels and a test:
//
//   for each group of as many primitives as threads
//     setup of mine: its box, and what pixels need, to shared memory
//     barrier
//     for my part of all (primitive, pixel of its box)
//       if the test holds: set the primitive's bit in the pixel's mask, and
//         put the pixel on a list with the first bit
//     barrier
//     for my pixels of the list
//       for each bit of the mask, the lowest first: update the pixel
//     barrier
//
// So small primitives leave few threads idle, and the updates of a pixel are in
// lineage order, because one thread makes them in the order of bits. Bits are
// set by atomics whose order nobody can see.
//
// A primitive that takes a rare branch, or whose box is not in the bin, ends
// its group before it. Then it is done alone, by all threads
// (PixelSharing.cpp), out of line; and the first of them leaves what is left of
// its unit to a launch of its own (RareLaunch.cpp), so that it decides about no
// register of the others.

#include "PikoToGPU/Pixels/PixelGroups.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Interfaces/SideEffectInterfaces.h"

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

static constexpr int64_t pixelBits = PixelGroup::pixelBits;

//===----------------------------------------------------------------------===//
// The two loops
//===----------------------------------------------------------------------===//

/// Takes what is rare out of the loop, into one of its own.
LogicalResult CollapsedPixels::split() {
  OpBuilder builder(items);
  rare = cast<scf::ForOp>(builder.clone(*items));
  isRareForOne = findObstacleToSharing(rare, tile).has_value();
  if (!isRareForOne && failed(sharePixels(rare, tile)))
    return failure();
  for (Block *block : nest.rare) {
    while (Operation *op = block->getTerminator()->getPrevNode())
      op->erase();
    Emitter inside(items.getLoc(), block->getTerminator());
    inside.change(arith::AtomicRMWKind::minu, thread, limit, inside.index(0));
  }
  nest.work->walk([&](UpdateOp update) {
    update->setAttr(marks::inside, builder.getUnitAttr());
  });
  return success();
}

/// What is to be zero when a group begins is so from the start; each group
/// leaves it as it was.
void CollapsedPixels::clear() {
  Emitter b(items.getLoc(),
            memory.flushWords.getParentBlock()->getTerminator());
  Operation *first = tile.place.back().getDefiningOp();
  b.setInsertionPointAfter(first);
  thread = b.cast(launch.getThreadIds().x, b.getI32Type());
  Type i32 = b.getI32Type();
  auto add = [&](int64_t size, Type type) {
    return addSharedMemory(launch, size, type);
  };
  ticket = add(1, i32), limit = add(1, i32), listed = add(1, i32);
  slots = add(group, i32), starts = add(group, i32);
  masks = add(words * pixels, i32);
  touched = add(llvm::divideCeil(pixels, 32), i32);
  list = add(pixels, b.getI16Type());
  until = add(1, i32);
  Value zero = b.number(0);
  Emitter one = b.when(b.is(thread, Predicate::eq, zero));
  one.store(zero, ticket, zero);
  one.store(zero, listed, zero);
  one.store(one.number(group), limit, zero);
  auto clearAll = [&](Value array) {
    int64_t size = cast<MemRefType>(array.getType()).getNumElements();
    auto loop = scf::ForOp::create(b, launch.getThreadIds().x, b.index(size),
                                   b.index(threads));
    Emitter inside(b.getLoc(), loop.getBody()->getTerminator());
    inside.store(zero, array, loop.getInductionVar());
  };
  clearAll(masks);
  clearAll(touched);
  b.barrier();
}

FailureOr<RareSite> CollapsedPixels::run() {
  clear();
  if (failed(split()))
    return failure();
  ItemSetup setup(items, tile, memory, Extent::All);
  createGroups(setup);
  items.erase();
  return site;
}

/// Where the first group begins: this is the launch that goes on where another
/// one has left a unit.
Value CollapsedPixels::resume(Emitter &b) {
  site.begin = items.getLowerBound();
  site.end = items.getUpperBound();
  site.rest =
      RestOp::create(b, b.getIndexType(), memory.log, launch.getBlockIds().x);
  site.isLeft = b.is(site.rest, Predicate::ne, b.index(0));
  Value from =
      arith::MaxSIOp::create(b, site.begin, b.sub(site.rest, b.index(1)));
  return b.select(site.isLeft, from, site.end);
}

void CollapsedPixels::createGroups(ItemSetup &setup) {
  Emitter b(items.getLoc(), items);
  BinArithmetic bins(b, b.getLoc(), stage);
  for (int64_t dim = 0, e = nest.getRank(); dim < e; ++dim) {
    Value number = nest.getNumber(dim);
    binLo.push_back(
        b.cast(bins.lo(nest.update.getBin(), dim), number.getType()));
    binHi.push_back(
        b.cast(bins.hi(nest.update.getBin(), dim), number.getType()));
  }
  Value begin = resume(b), end = items.getUpperBound();
  auto groups = site.groups = scf::WhileOp::create(
      b, TypeRange{b.getIndexType()}, ValueRange{begin},
      [&](OpBuilder &at, Location loc, ValueRange next) {
        Value more =
            arith::CmpIOp::create(at, loc, Predicate::slt, next[0], end);
        scf::ConditionOp::create(at, loc, more, next);
      },
      [&](OpBuilder &at, Location loc, ValueRange now) {
        scf::YieldOp::create(at, loc, now);
      });
  Operation *yield = groups.getAfterBody()->getTerminator();
  base = groups.getAfterArguments()[0];
  b.setInsertionPoint(yield);
  Value mine = b.add(base, launch.getThreadIds().x);
  Value has = b.is(mine, Predicate::slt, end);
  if (group < threads)
    has = b.both(has, b.is(thread, Predicate::slt, b.number(group)));
  Emitter own = b.when(has);
  setup.createSetup(own, mine,
                    [&](Operation *op, OpBuilder &at, const IRMapping &values) {
                      note(op, at, values);
                    });
  b.barrier();

  // From here on the loop's body is a pattern for what is done with pixels.
  items->moveBefore(yield);
  Emitter inside(items.getLoc(), &items.getBody()->front());
  Value position = inside.add(base, items.getInductionVar());
  items.getInductionVar().replaceAllUsesExcept(position,
                                               position.getDefiningOp());
  setup.replaceInPixels();
  findCovered(b);
  b.barrier();
  updatePixels(b);
  b.barrier();
  yield->setOperand(0, runRare(b));
}

//===----------------------------------------------------------------------===//
// Boxes
//===----------------------------------------------------------------------===//

/// In the setup of a primitive: that it is rare, or what its box is.
void CollapsedPixels::note(Operation *op, OpBuilder &at,
                           const IRMapping &mapping) {
  Emitter b(op->getLoc(), at.getInsertionBlock(), at.getInsertionPoint());
  if (isa<memref::AtomicRMWOp>(op)) {
    b.change(arith::AtomicRMWKind::minu, thread, limit, b.index(0));
    return;
  }
  if (op != nest.anchor)
    return;
  Value some = b.truth(true), inBin = b.truth(true), size = b.number(1);
  for (int64_t dim = 0, e = nest.getRank(); dim < e; ++dim) {
    const PixelLoop *loop = nest.getLoop(dim);
    Value lo = mapping.lookupOrDefault(nest.getFirst(dim));
    inBin = b.both(inBin, b.is(lo, Predicate::sge, binLo[dim]));
    if (!loop) {
      inBin = b.both(inBin, b.is(lo, Predicate::slt, binHi[dim]));
      continue;
    }
    Value hi = mapping.lookupOrDefault(loop->getEnd());
    some = b.both(some, b.is(lo, Predicate::slt, hi));
    inBin = b.both(inBin, b.is(hi, Predicate::sle, binHi[dim]));
    size = b.mul(size, b.toNumber(b.sub(hi, lo)));
  }
  Emitter full = b.when(some);
  auto branch = scf::IfOp::create(full, inBin, /*withElseRegion=*/true);
  Emitter boxed(b.getLoc(), branch.thenBlock()->getTerminator());
  addBox(boxed, size);
  Emitter outside(b.getLoc(), branch.elseBlock()->getTerminator());
  outside.change(arith::AtomicRMWKind::minu, thread, limit, outside.index(0));
}

/// Gives the box the next slot, and its pixels the next numbers.
void CollapsedPixels::addBox(Emitter &b, Value size) {
  Value increment = b.add(size, b.number(1 << pixelBits));
  Value old =
      b.change(arith::AtomicRMWKind::addi, increment, ticket, b.index(0));
  Value slot = b.shr(old, b.number(pixelBits));
  b.store(thread, slots, slot);
  b.store(b.both(old, b.number((1 << pixelBits) - 1)), starts, slot);
}

//===----------------------------------------------------------------------===//
// Coverage
//===----------------------------------------------------------------------===//

/// The slot of the box with the pixel of this number, by bisection.
Value CollapsedPixels::findSlot(Emitter &b, Value count, Value first) {
  Value slot = b.number(0);
  for (int64_t step = group / 2; step > 0; step /= 2) {
    Value next = b.add(slot, b.number(step));
    Value isIn = b.both(b.is(next, Predicate::slt, count),
                        b.is(b.load(starts, next), Predicate::sle, first));
    slot = b.select(isIn, next, slot);
  }
  return slot;
}

void piko::cloneUntil(Emitter &b, Block *block, Operation *end,
                      IRMapping &mapping) {
  for (Operation &op : *block) {
    if (&op == end)
      break;
    b.clone(op, mapping);
  }
}

/// The box of a primitive, of what its setup has left.
CollapsedPixels::Box CollapsedPixels::cloneBox(Emitter &b, IRMapping &mapping) {
  for (auto [block, next] : nest.levels) {
    cloneUntil(b, block, next, mapping);
    if (next == nest.anchor)
      break;
  }
  if (nest.loops.empty())
    cloneUntil(b, nest.work, nest.anchor, mapping);
  Box box;
  for (int64_t dim = 0, e = nest.getRank(); dim < e; ++dim) {
    const PixelLoop *loop = nest.getLoop(dim);
    Value lo = mapping.lookupOrDefault(nest.getFirst(dim));
    Value extent = b.number(1);
    if (loop)
      extent = b.toNumber(b.sub(mapping.lookupOrDefault(loop->getEnd()), lo));
    box.push_back({lo, extent});
  }
  return box;
}

/// Lets counters be the pixel.
void CollapsedPixels::mapCounters(IRMapping &mapping, ArrayRef<Value> cell) {
  for (int64_t dim = 0, e = nest.getRank(); dim < e; ++dim)
    if (const PixelLoop *loop = nest.getLoop(dim))
      mapping.map(loop->getCounter(), cell[dim]);
}

/// Each thread has a part of the pixels of all boxes that is in one piece.
void CollapsedPixels::findCovered(Emitter &b) {
  Value zero = b.number(0);
  Value all = b.load(ticket, zero);
  b.store(b.load(limit, zero), until, zero);
  Value count = b.shr(all, b.number(pixelBits));
  Value total = b.both(all, b.number((1 << pixelBits) - 1));
  Value share = b.shr(b.add(total, b.number(threads - 1)),
                      b.number(llvm::Log2_64(threads)));
  Value first = b.mul(thread, share);
  Value last = arith::MinSIOp::create(b, b.add(first, share), total);
  Emitter some = b.when(b.is(first, Predicate::slt, last));
  SmallVector<Value> state = findFirst(some, count, first);
  auto loop = scf::ForOp::create(some, first, last, some.number(1), state);
  Emitter in(b.getLoc(), loop.getBody(), loop.getBody()->end());
  scf::YieldOp::create(in, testPixel(in, loop.getRegionIterArgs()));
}

/// Slot and place in its box of the pixel with a number.
SmallVector<Value> CollapsedPixels::findFirst(Emitter &b, Value count,
                                              Value first) {
  Value slot = findSlot(b, count, first);
  IRMapping mapping;
  mapping.map(items.getInductionVar(), b.toIndex(b.load(slots, slot)));
  Box box = cloneBox(b, mapping);
  Value rest = b.sub(first, b.load(starts, slot));
  SmallVector<Value> state{slot};
  for (auto [lo, extent] : ArrayRef(box).drop_back()) {
    state.push_back(arith::RemUIOp::create(b, rest, extent));
    rest = arith::DivUIOp::create(b, rest, extent);
  }
  state.push_back(rest);
  return state;
}

/// Marks the pixel if it passes the tests; returns slot and place of the next.
SmallVector<Value> CollapsedPixels::testPixel(Emitter &b, ValueRange now) {
  Value item = b.load(slots, now[0]);
  Value position = b.add(base, b.toIndex(item));
  memory.setPosition(b, position);
  IRMapping mapping;
  mapping.map(items.getInductionVar(), b.toIndex(item));
  Box box = cloneBox(b, mapping);
  SmallVector<Value> cell;
  for (auto [place, side] : llvm::zip(now.drop_front(), box))
    cell.push_back(b.add(side.lo, b.fromNumber(place, side.lo.getType())));
  mapCounters(mapping, cell);
  Emitter at = b;
  for (auto [block, next] : nest.levels) {
    if (!nest.isInside(next))
      continue;
    cloneUntil(at, block, next, mapping);
    if (auto test = dyn_cast<scf::IfOp>(next))
      at = at.when(mapping.lookupOrDefault(test.getCondition()));
  }
  addPixel(at, item, cell);

  b.setInsertionPointToEnd(b.getInsertionBlock());
  SmallVector<Value> next{now[0]};
  Value carry = b.number(1);
  for (auto [place, side] : llvm::zip(now.drop_front(), box)) {
    Value more = b.add(place, carry);
    Value ends = b.is(more, Predicate::sge, side.extent);
    next.push_back(b.select(ends, b.number(0), more));
    carry = arith::ExtUIOp::create(b, b.getI32Type(), ends);
  }
  next.front() = b.add(now[0], carry);
  return next;
}

/// Sets the primitive's bit in the pixel's mask.
void CollapsedPixels::addPixel(Emitter &b, Value item, ArrayRef<Value> cell) {
  Value pixel;
  for (int64_t dim = cell.size(); dim-- > 0;) {
    Value at = b.toNumber(b.sub(cell[dim], binLo[dim]));
    pixel =
        pixel ? b.add(b.mul(pixel, b.number(stage.getBins()[dim])), at) : at;
  }
  auto bitOf = [&](Emitter &at, Value number) {
    return at.shl(at.number(1), at.both(number, at.number(31)));
  };
  constexpr auto setBits = arith::AtomicRMWKind::ori;
  Value place = pixel;
  if (words > 1)
    place = b.add(b.shl(pixel, b.number(1)), b.shr(item, b.number(5)));
  Value old = b.change(setBits, bitOf(b, item), masks, place);
  Emitter first = b.when(b.is(old, Predicate::eq, b.number(0)));
  if (words > 1) {
    Value bit = bitOf(first, pixel);
    Value others =
        first.change(setBits, bit, touched, first.shr(pixel, first.number(5)));
    first = first.when(
        first.is(first.both(others, bit), Predicate::eq, first.number(0)));
  }
  Value last = first.change(arith::AtomicRMWKind::addi, first.number(1), listed,
                            first.index(0));
  first.store(arith::TruncIOp::create(first, first.getI16Type(), pixel), list,
              last);
}

//===----------------------------------------------------------------------===//
// All of it
//===----------------------------------------------------------------------===//

/// Erases copies of what is not needed.
static void eraseDead(Block &block) {
  for (Operation &op : llvm::make_early_inc_range(llvm::reverse(block))) {
    for (Region &region : op.getRegions())
      for (Block &inner : region)
        eraseDead(inner);
    if (isOpTriviallyDead(&op))
      op.erase();
  }
}

FailureOr<RareSite> piko::collapsePixels(scf::ForOp items, PixelNest &nest,
                                         StageOp stage, const ThreadTile &tile,
                                         GridMemory &memory) {
  FailureOr<RareSite> site =
      CollapsedPixels(items, nest, stage, tile, memory).run();
  if (succeeded(site))
    eraseDead(memory.launch.getBody().front());
  return site;
}
