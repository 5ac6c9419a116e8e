// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Rounds of primitives in two launches, after they are mapped to threads.
// The first one leaves a unit before the first round with a rare primitive,
// which is noted where that is found: what the threads have emitted in this
// round is dropped, and its position left in the log. Where work in the same
// bin takes what is emitted, the unit is left where that bin begins, and what
// was kept of it is forgotten.

#include "PikoToGPU/Blocks/BlockMapping.h"
#include "PikoToGPU/Emitter.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "pikort/grid.h"

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

/// The second launch begins where the first one has left a unit.
static void resume(scf::ForOp rounds, GridMemory &memory) {
  auto buckets = cast<scf::ForOp>(rounds->getParentOp());
  Emitter b(buckets.getLoc(), buckets);
  Value rest = RestOp::create(b, b.getIndexType(), memory.log,
                              memory.launch.getBlockIds().x);
  Value isLeft = b.is(rest, Predicate::ne, b.index(0));
  Value place = b.sub(rest, b.index(1));
  scf::ForOp loop = memory.locals.empty() ? rounds : buckets;
  Emitter in(loop.getLoc(), loop);
  Value from = arith::MaxSIOp::create(in, loop.getLowerBound(), place);
  loop.setLowerBound(in.select(isLeft, from, loop.getUpperBound()));
}

/// Nothing that threads have emitted since the last flush was ever there.
static void dropEmissions(Emitter &b, GridMemory &memory) {
  for (int64_t base = 0, e = memory.getWords(); base < e;
       base += PIKOIR_APPEND_WORDS) {
    auto at = [&](int64_t word) { return b.index(base + word); };
    b.store(b.load(memory.buffers, at(PIKOIR_APPEND_CURSOR)), memory.buffers,
            at(PIKOIR_APPEND_BEGIN));
    b.store(b.number(b.getI64Type(), 0), memory.buffers,
            at(PIKOIR_APPEND_KEPT));
  }
}

namespace {

/// What a loop that the first launch leaves has become.
struct LeavingRounds {
  /// `mark` is in an iteration of it.
  explicit LeavingRounds(LeaveRoundOp mark);

  scf::ForOp buckets, rounds;
  scf::IfOp iteration; ///< A thread's, in a round.
};

} // namespace

static bool isRounds(Operation *op) {
  auto loop = dyn_cast<scf::ForOp>(op);
  return loop && !loop.getBody()->getOps<FlushOp>().empty();
}

LeavingRounds::LeavingRounds(LeaveRoundOp mark) {
  Operation *inside = mark;
  while (!isRounds(inside->getParentOp()))
    inside = inside->getParentOp();
  iteration = cast<scf::IfOp>(inside);
  rounds = cast<scf::ForOp>(inside->getParentOp());
  buckets = cast<scf::ForOp>(rounds->getParentOp());
}

/// The first launch ends a unit before the first round with a rare
/// primitive.
static void leave(ArrayRef<LeaveRoundOp> marks, GridMemory &memory) {
  auto [buckets, rounds, iteration] = LeavingRounds(marks.front());
  // Whether a thread has come to a rare primitive, and whether the unit has
  // been left.
  Type i32 = IntegerType::get(rounds.getContext(), 32);
  Value foundWord = addSharedMemory(memory.launch, 1, i32),
        leftWord = addSharedMemory(memory.launch, 1, i32);
  for (LeaveRoundOp mark : marks) {
    Emitter at(mark.getLoc(), mark);
    at.store(at.number(1), foundWord, at.index(0));
    mark.erase();
  }
  Emitter begin(buckets.getLoc(), buckets);
  Value thread = memory.launch.getThreadIds().x;
  Value isFirst = begin.is(thread, Predicate::eq, begin.index(0));
  Emitter one = begin.when(isFirst);
  for (Value word : {foundWord, leftWord})
    one.store(one.number(0), word, one.index(0));
  begin.barrier();

  auto isThere = [&](Emitter &at) {
    return at.is(at.loadAgain(leftWord), Predicate::eq, at.number(0));
  };
  FlushOp flush = *rounds.getBody()->getOps<FlushOp>().begin();
  Emitter b(flush.getLoc(), flush);
  b.barrier();
  Value isFound = b.is(b.loadAgain(foundWord), Predicate::ne, b.number(0));
  Emitter found = b.when(isFound);
  dropEmissions(found, memory);
  // Rounds after it come here, too.
  Emitter leaves = found.when(found.both(isFirst, isThere(found)));
  leaves.store(leaves.number(1), leftWord, leaves.index(0));
  LeaveRestOp::create(leaves, memory.log, memory.launch.getBlockIds().x,
                      memory.locals.empty() ? rounds.getInductionVar()
                                            : buckets.getInductionVar());

  Emitter top(rounds.getLoc(), iteration);
  iteration.getConditionMutable().assign(
      top.both(iteration.getCondition(), isThere(top)));
  for (auto local : llvm::to_vector(buckets.getBody()->getOps<LocalBinOp>())) {
    Emitter at(local.getLoc(), local);
    Emitter inside = at.when(isThere(at));
    local->moveBefore(&*inside.getInsertionPoint());
  }
}

void piko::mapRareRounds(GridMemory &memory) {
  if (auto marks = collect<LeaveRoundOp>(memory.launch); !marks.empty())
    leave(marks, memory);
  for (scf::ForOp loop : collect<scf::ForOp>(memory.launch))
    if (loop->removeAttr(marks::rest))
      resume(loop, memory);
}
