// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A kernel whose threads share primitives that they emit from, and call a
// function for rare ones (RareBranches.cpp), has two launches:
//   1. rounds up to the first one with a rare primitive, which is noted where
//      that is found: what the threads have emitted in this round is dropped,
//      and its position left in the log. No call;
//   2. for units of which something was left, rounds from there on, with calls.
// All that the usual way does is to emit: anything else would be done twice.
// Emissions keep their order: the second launch's directories come after those
// of the first. Where work in the same bin takes what is emitted, the unit is
// left where that bin begins, and what was kept of it is forgotten. What
// threads have of append buffers is in shared memory then, as are the counters
// of units and buckets.

#include "PikoToGPU/PikoToGPU.h"

#include "PikoToGPU/Emitter.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"

#include "mlir/IR/IRMapping.h"

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

/// Whether doing it twice would show, but for what is emitted.
static bool changesState(Operation *op) {
  auto access = dyn_cast<StateAccessOpInterface>(op);
  return (access && access.getAccessKinds() != StateAccess::reads) ||
         isa<AllocateOp, ScratchOp>(op);
}

static SmallVector<scf::ExecuteRegionOp> findRare(Operation *loop) {
  SmallVector<scf::ExecuteRegionOp> rare;
  loop->walk([&](scf::ExecuteRegionOp apart) {
    if (apart->hasAttr(marks::rare))
      rare.push_back(apart);
  });
  return rare;
}

/// The loop over buckets around a loop over primitives that are stored.
static scf::ForOp getBuckets(scf::ForOp loop, gpu::LaunchOp launch) {
  auto buckets = dyn_cast<scf::ForOp>(loop->getParentOp());
  bool isIt = buckets && buckets->getParentOp() == launch &&
              buckets.getUpperBound().getDefiningOp<UnitBucketsOp>();
  return isIt ? buckets : scf::ForOp();
}

/// Whether a loop emits to work in the same bin alone, and tells no positions.
static bool emitsLocally(scf::ForOp loop, const GridMemory &memory) {
  return !contains(loop, [&](Operation *op) {
    auto append = dyn_cast<AppendOp>(op);
    return isa<NextOp>(op) ||
           (append && (append.getWriter() != memory.log ||
                       llvm::none_of(memory.locals, [&](const auto &edge) {
                         return edge.first == memory.stage &&
                                edge.second ==
                                    static_cast<int64_t>(append.getPort());
                       })));
  });
}

static bool canLeave(scf::ForOp loop, const GridMemory &memory) {
  scf::ForOp buckets = getBuckets(loop, memory.launch);
  if (!buckets || !memory.queues.empty())
    return false;
  SmallVector<scf::ExecuteRegionOp> rare = findRare(loop);
  if (rare.empty() || llvm::any_of(rare, [](scf::ExecuteRegionOp apart) {
        return apart->getNumResults() != 0;
      }))
    return false;
  auto isRare = [&](Operation *op) {
    return llvm::any_of(rare, [&](scf::ExecuteRegionOp apart) {
      return apart->isProperAncestor(op);
    });
  };
  for (Operation &op : *buckets.getBody())
    if (&op != loop && !isa<LocalBinOp>(op) &&
        contains(&op, [](Operation *inner) {
          return changesState(inner) || isa<AppendOp, NextOp>(inner);
        }))
      return false;
  return !contains(loop, [&](Operation *op) {
    return changesState(op) && !isRare(op);
  }) && (memory.locals.empty() || emitsLocally(loop, memory));
}

std::optional<GridMemory> piko::leaveRareRounds(scf::ForOp loop,
                                                GridMemory &memory) {
  if (!canLeave(loop, memory))
    return std::nullopt;
  gpu::LaunchOp first = memory.launch;
  OpBuilder builder(first);
  builder.setInsertionPointAfter(first);
  IRMapping copies;
  GridMemory rest = memory;
  rest.launch = cast<gpu::LaunchOp>(builder.clone(*first, copies));
  StringRef name = first.getFunctionAttr().getLeafReference();
  rest.launch.setFunctionAttr(
      FlatSymbolRefAttr::get(builder.getContext(), (name + "_rest").str()));
  for (Value *each : {&rest.buffers, &rest.kept, &rest.flushWords})
    if (*each)
      *each = copies.lookup(*each);
  rest.rare.emplace();
  rest.rare->loop = cast<scf::ForOp>(copies.lookup(loop.getOperation()));
  rest.rare->buckets = getBuckets(rest.rare->loop, rest.launch);
  memory.rare.emplace();
  memory.rare->loop = loop;
  memory.rare->buckets = getBuckets(loop, first);
  memory.rare->found = addSharedMemory(first, 1, builder.getI32Type());
  memory.rare->left = addSharedMemory(first, 1, builder.getI32Type());
  for (scf::ExecuteRegionOp apart : findRare(loop)) {
    Emitter b(apart.getLoc(), apart);
    b.store(b.number(1), memory.rare->found, b.index(0));
    apart.erase();
  }
  return rest;
}

/// The second launch begins where the first one has left a unit.
static void resume(GridMemory &memory) {
  RareRounds &rare = *memory.rare;
  Emitter b(rare.buckets.getLoc(), rare.buckets);
  Value rest = RestOp::create(b, b.getIndexType(), memory.log,
                              memory.launch.getBlockIds().x);
  Value isLeft = b.is(rest, Predicate::ne, b.index(0));
  Value place = b.sub(rest, b.index(1));
  scf::ForOp loop = memory.locals.empty() ? rare.rounds : rare.buckets;
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

/// The first launch ends a unit before the first round with a rare
/// primitive.
static void leave(GridMemory &memory) {
  RareRounds &rare = *memory.rare;
  Emitter begin(rare.buckets.getLoc(), rare.buckets);
  Value thread = memory.launch.getThreadIds().x;
  Value isFirst = begin.is(thread, Predicate::eq, begin.index(0));
  Emitter one = begin.when(isFirst);
  for (Value word : {rare.found, rare.left})
    one.store(one.number(0), word, one.index(0));
  begin.barrier();

  auto isThere = [&](Emitter &at) {
    return at.is(at.loadAgain(rare.left), Predicate::eq, at.number(0));
  };
  FlushOp flush = *rare.rounds.getBody()->getOps<FlushOp>().begin();
  Emitter b(flush.getLoc(), flush);
  b.barrier();
  Value isFound = b.is(b.loadAgain(rare.found), Predicate::ne, b.number(0));
  Emitter found = b.when(isFound);
  dropEmissions(found, memory);
  // Rounds after it come here, too.
  Emitter leaves = found.when(found.both(isFirst, isThere(found)));
  leaves.store(leaves.number(1), rare.left, leaves.index(0));
  LeaveRestOp::create(leaves, memory.log, memory.launch.getBlockIds().x,
                      memory.locals.empty() ? rare.rounds.getInductionVar()
                                            : rare.buckets.getInductionVar());

  Emitter top(rare.rounds.getLoc(), rare.iteration);
  rare.iteration.getConditionMutable().assign(
      top.both(rare.iteration.getCondition(), isThere(top)));
  for (auto local :
       llvm::to_vector(rare.buckets.getBody()->getOps<LocalBinOp>())) {
    Emitter at(local.getLoc(), local);
    Emitter inside = at.when(isThere(at));
    local->moveBefore(&*inside.getInsertionPoint());
  }
}

void piko::finishRareRounds(GridMemory &memory) {
  if (memory.rare->found)
    leave(memory);
  else
    resume(memory);
}
