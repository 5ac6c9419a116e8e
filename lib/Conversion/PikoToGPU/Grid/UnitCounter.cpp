// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Blocks that take the next unit of work when they have ended one, so that
// none waits for a block whose units take longer.
//   1. Where the block begins, the first thread finds out how many units are
//      taken at a time. If the hardware dispatches, a grid of as many blocks
//      as there are units takes none: block b has unit b, and it is the
//      hardware that begins one where another has ended.
//   2. Before each unit it finds the unit's number: the next one of those
//      that the block has, or else the launch's counter is moved on by an
//      atomic addition.
//   3. After a barrier all threads read it in shared memory, and end
//      alike where there is none.
// What only the first thread needs is in shared memory, too: it would take
// registers of all threads for as long as the kernel runs.

#include "PikoToGPU/Emitter.h"
#include "PikoToGPU/Grid/UnitLoops.h"

#include "Piko/Dialect/Piko/IR/PikoGPU.h"

#include "mlir/Dialect/Math/IR/Math.h"

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

/// A block takes at least so many times on average: a take that comes late is
/// little of its work.
static constexpr int64_t takesOfBlock = 16;
/// The number of no unit.
static constexpr int64_t none = -1;

namespace {

class UnitTaking {
public:
  UnitTaking(scf::ForOp units, gpu::LaunchOp launch, Value log, bool dispatches)
      : units(units), launch(launch), log(log), dispatches(dispatches),
        count(units.getUpperBound().getDefiningOp<UnitCountOp>()) {}

  void run(bool inBlock);

private:
  Value isFirstThread(Emitter &b) {
    return b.is(launch.getThreadIds().x, Predicate::eq, b.index(0));
  }
  static Value toUnit(Emitter &b, Value number) {
    return arith::IndexCastUIOp::create(b, b.getIndexType(), number);
  }
  static Value toNumber(Emitter &b, Value unit) {
    return arith::IndexCastUIOp::create(b, b.getI32Type(), unit);
  }
  void begin(Emitter &b);
  void findNext(Emitter &b);
  Value take(Emitter &b, Value number);

  scf::ForOp units;
  gpu::LaunchOp launch;
  Value log;
  bool dispatches; ///< The hardware may, where there are few units.
  UnitCountOp count;
  /// In shared memory: the unit that it runs, the end of those that it has
  /// taken, and how many it takes at a time, 0 where it takes none.
  Value unit, end, several;
};

} // namespace

/// `first`, or where that does not hold what `otherwise` computes.
static Value choose(Emitter &b, Value test, Value first,
                    llvm::function_ref<Value(Emitter &)> otherwise) {
  auto branch = scf::IfOp::create(
      b, test,
      [&](OpBuilder &at, Location loc) {
        scf::YieldOp::create(at, loc, first);
      },
      [&](OpBuilder &at, Location loc) {
        Emitter in(loc, at.getInsertionBlock(), at.getInsertionPoint());
        scf::YieldOp::create(in, otherwise(in));
      });
  return branch.getResult(0);
}

/// Takes several at a time where there are very many: the counter is one
/// address for all blocks.
void UnitTaking::begin(Emitter &b) {
  Value block = launch.getBlockIds().x, blocks = launch.getGridSize().x;
  Value number = toNumber(b, block), zero = b.number(0);
  Value isOwn =
      dispatches ? b.is(count, Predicate::ule, blocks) : b.truth(false);
  constexpr int64_t bits = 32 + llvm::ConstantLog2<takesOfBlock>();
  Value zeros = math::CountLeadingZerosOp::create(b, toNumber(b, blocks));
  Value shift = toUnit(b, b.sub(b.number(bits), zeros));
  Value many = arith::MaxUIOp::create(b, b.shr(count, shift), b.index(1));
  b.store(b.select(isOwn, zero, toNumber(b, many)), several, b.index(0));
  // Before the block's own.
  Value before = b.sub(number, b.number(1)), after = b.add(number, b.number(1));
  b.store(b.select(isOwn, before, b.number(none)), unit, b.index(0));
  b.store(b.select(isOwn, after, zero), end, b.index(0));
}

Value UnitTaking::take(Emitter &b, Value number) {
  Value first =
      TakeUnitsOp::create(b, b.getIndexType(), log, toUnit(b, number));
  Value all = UnitCountOp::create(b, count.getBins());
  Value last = arith::MinUIOp::create(b, b.add(first, toUnit(b, number)), all);
  b.store(toNumber(b, last), end, b.index(0));
  Value isThere = b.is(first, Predicate::ult, all);
  return b.select(isThere, toNumber(b, first), b.number(none));
}

void UnitTaking::findNext(Emitter &b) {
  Value next = b.add(b.load(unit, b.index(0)), b.number(1));
  Value has = b.is(next, Predicate::ult, b.load(end, b.index(0)));
  Value found = choose(b, has, next, [&](Emitter &in) {
    Value number = in.load(several, in.index(0));
    Value takesNone = in.is(number, Predicate::eq, in.number(0));
    return choose(in, takesNone, in.number(none),
                  [&](Emitter &other) { return take(other, number); });
  });
  b.store(found, unit, b.index(0));
}

/// `inBlock`: threads load the unit's number wherever they need it.
void UnitTaking::run(bool inBlock) {
  // Blocks that have no unit, of a grid that has more, end at once.
  Emitter outside(units.getLoc(), units);
  Emitter b =
      outside.when(outside.is(launch.getBlockIds().x, Predicate::ult, count));
  for (Value *word : {&unit, &end, &several})
    *word = addSharedMemory(launch, 1, b.getI32Type());
  Emitter first = b.when(isFirstThread(b));
  begin(first);
  auto made = scf::WhileOp::create(
      b, TypeRange(), ValueRange(),
      [&](OpBuilder &at, Location loc, ValueRange) {
        Emitter in(loc, at.getInsertionBlock(), at.getInsertionPoint());
        Emitter one = in.when(isFirstThread(in));
        findNext(one);
        in.barrier();
        Value number =
            inBlock ? in.loadAgain(unit) : in.load(unit, in.index(0));
        Value isOne = in.is(number, Predicate::ne, in.number(none));
        scf::ConditionOp::create(in, isOne, ValueRange());
      },
      [&](OpBuilder &at, Location loc, ValueRange) {
        scf::YieldOp::create(at, loc);
      });
  loadForUses(units.getInductionVar(), units, unit, inBlock);
  Block *body = made.getAfterBody();
  units.getBody()->getTerminator()->erase();
  body->getOperations().splice(body->begin(), units.getBody()->getOperations());
  units.erase();
}

void piko::takeUnitsForRest(gpu::LaunchOp launch) {
  launch.walk([](TakeUnitsOp take) { take.setRest(true); });
}

void piko::takeUnits(scf::ForOp units, gpu::LaunchOp launch, Value log,
                     bool dispatches, bool inBlock) {
  UnitTaking(units, launch, log, dispatches).run(inBlock);
}
