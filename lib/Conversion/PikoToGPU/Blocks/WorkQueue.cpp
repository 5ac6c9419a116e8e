// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// When what iterations have put off is done: all of it, the longest first, by a
// counting sort of the queue's entries.

#include "PikoToGPU/Blocks/WorkQueue.h"

#include "PikoToGPU/Emitter.h"

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

/// Nothing waits after each drain, too.
static void clear(Emitter &b, DrainOp drain, Value thread) {
  Emitter one = b.when(b.is(thread, Predicate::ult, b.index(lengthClasses)));
  one.store(one.number(0), drain.getLengths(), thread);
  one.store(one.number(0), drain.getCount(), one.index(0));
  b.barrier();
}

void piko::clearQueue(OpBuilder &builder, DrainOp drain) {
  Emitter b(drain.getLoc(), builder.getInsertionBlock(),
            builder.getInsertionPoint());
  clear(b, drain, drain->getParentOfType<gpu::LaunchOp>().getThreadIds().x);
}

/// Where each class begins: after all longer ones.
static void createStarts(Emitter &b, DrainOp drain, Value thread) {
  Emitter own = b.when(b.is(thread, Predicate::ult, b.index(lengthClasses)));
  Value first = own.add(thread, own.index(1));
  auto sum = scf::ForOp::create(own, first, own.index(lengthClasses),
                                own.index(1), ValueRange{own.number(0)});
  Emitter in(b.getLoc(), sum.getBody(), sum.getBody()->end());
  scf::YieldOp::create(in, ValueRange{in.add(sum.getRegionIterArg(0),
                                             in.load(drain.getLengths(),
                                                     sum.getInductionVar()))});
  own.store(sum.getResult(0), drain.getStarts(), thread);
}

static void createOrder(Emitter &b, DrainOp drain, Value thread, Value count,
                        int64_t threads) {
  auto each = scf::ForOp::create(b, thread, count, b.index(threads));
  Emitter in(b.getLoc(), each.getBody()->getTerminator());
  Value slot = each.getInductionVar();
  Value known = in.load(drain.getClasses(), slot);
  Value start = in.load(drain.getStarts(), in.both(known, in.number(255)));
  Value place = in.add(start, in.shr(known, in.number(8)));
  in.store(in.cast(slot, in.getI16Type()), drain.getOrder(), place);
}

scf::ForOp piko::drainQueue(DrainOp drain, OpBuilder &builder, Value isLast) {
  Emitter b(drain.getLoc(), builder.getInsertionBlock(),
            builder.getInsertionPoint());
  auto launch = drain->getParentOfType<gpu::LaunchOp>();
  Value thread = launch.getThreadIds().x;
  int64_t threads = getBlockSize(launch);
  b.barrier();
  Value waiting = b.load(drain.getCount(), b.index(0));
  b.barrier(); // before others come
  Value isFull =
      b.is(waiting, Predicate::sgt, b.number(drain.getCapacity() - threads));
  Value any = b.is(waiting, Predicate::ne, b.number(0));
  Emitter in = b.when(b.both(any, b.either(isFull, isLast)));
  createStarts(in, drain, thread);
  in.barrier();
  Value end = in.toIndex(waiting);
  createOrder(in, drain, thread, end, threads);
  in.barrier();
  auto work = scf::ForOp::create(in, thread, end, in.index(threads));
  Emitter at(drain.getLoc(), work.getBody()->getTerminator());
  Value slot = at.load(drain.getOrder(), work.getInductionVar());
  Value entry = arith::IndexCastUIOp::create(at, at.getIndexType(), slot);
  drain.getEntry().replaceAllUsesWith(entry);
  work.getBody()->getOperations().splice(
      work.getBody()->getTerminator()->getIterator(),
      drain.getBodyBlock()->getOperations());
  clear(in, drain, thread);
  builder.setInsertionPoint(b.getInsertionBlock(), b.getInsertionPoint());
  return work;
}
