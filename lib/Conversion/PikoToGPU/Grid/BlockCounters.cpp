// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Counters of loops that all threads of a block run alike: over its units, and
// over the buckets of one. Each would take two registers of every thread for as
// long as the loop runs, and with it what follows from it: addresses, the end
// of the loop. So
//   1. the counter is in shared memory, and one thread counts it on between
//      two barriers;
//   2. each use loads it again, which LLVM may not do before a loop.
// So is what a loop over groups of primitives needs of the bucket: each thread
// writes it, the same as others, and reads what it has written.

#include "PikoToGPU/Emitter.h"
#include "PikoToGPU/Grid/UnitLoops.h"

#include "LoadPlace.h"

#include "mlir/Dialect/Utils/StaticValueUtils.h"
#include "mlir/Transforms/RegionUtils.h"
#include "llvm/ADT/MapVector.h"

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

void piko::loadForUses(Value number, Operation *loop, Value memory,
                       bool again) {
  llvm::MapVector<Operation *, SmallVector<OpOperand *>> places;
  for (OpOperand &use : number.getUses())
    if (loop->isProperAncestor(use.getOwner()))
      places[findLoadPlace(use.getOwner(), loop)].push_back(&use);
  for (auto &[place, uses] : places) {
    Emitter b(loop->getLoc(), place);
    Value loaded = again ? b.loadAgain(memory) : b.load(memory, b.index(0));
    if (loaded.getType() != number.getType())
      loaded = arith::IndexCastUIOp::create(b, number.getType(), loaded);
    for (OpOperand *use : uses)
      use->set(loaded);
  }
}

void piko::countInBlock(scf::ForOp loop, gpu::LaunchOp launch,
                        llvm::function_ref<Value(OpBuilder &)> createEnd) {
  Emitter b(loop.getLoc(), loop);
  Value counter = addSharedMemory(launch, 1, b.getIndexType()), step;
  if (!isConstantIntValue(loop.getStep(), 1)) {
    step = addSharedMemory(launch, 1, b.getIndexType());
    b.store(loop.getStep(), step, b.index(0));
  }
  auto setByOne = [&](Emitter &at, llvm::function_ref<Value(Emitter &)> value) {
    Value thread = launch.getThreadIds().x;
    Emitter one = at.when(at.is(thread, Predicate::eq, at.index(0)));
    one.store(value(one), counter, one.index(0));
    at.barrier();
  };
  setByOne(b, [&](Emitter &) { return loop.getLowerBound(); });
  loadForUses(loop.getInductionVar(), loop, counter);
  auto made = scf::WhileOp::create(
      b, TypeRange(), ValueRange(),
      [&](OpBuilder &at, Location loc, ValueRange) {
        Emitter in(loc, at.getInsertionBlock(), at.getInsertionPoint());
        Value more =
            in.is(in.loadAgain(counter), Predicate::slt, createEnd(in));
        scf::ConditionOp::create(in, more, ValueRange());
      },
      [&](OpBuilder &at, Location loc, ValueRange) {
        Emitter in(loc, at.getInsertionBlock(), at.getInsertionPoint());
        in.barrier(); // before others are told the next number
        setByOne(in, [&](Emitter &one) {
          return one.add(one.loadAgain(counter),
                         step ? one.loadAgain(step) : one.index(1));
        });
        scf::YieldOp::create(in, ValueRange());
      });
  Block *body = made.getAfterBody();
  loop.getBody()->getTerminator()->erase();
  body->getOperations().splice(body->begin(), loop.getBody()->getOperations());
  loop.erase();
}

void piko::countBucketsInBlock(scf::ForOp units, gpu::LaunchOp launch) {
  SmallVector<scf::ForOp> buckets;
  for (auto loop : units.getBody()->getOps<scf::ForOp>())
    if (loop.getUpperBound().getDefiningOp<UnitBucketsOp>())
      buckets.push_back(loop);
  for (scf::ForOp loop : buckets) {
    auto of = loop.getUpperBound().getDefiningOp<UnitBucketsOp>();
    countInBlock(loop, launch, [&](OpBuilder &builder) {
      return cast<UnitBucketsOp>(builder.clone(*of)).getEnd();
    });
  }
}

void piko::countUnitsInBlock(scf::ForOp units, gpu::LaunchOp launch) {
  auto count = units.getUpperBound().getDefiningOp<UnitCountOp>();
  countInBlock(units, launch, [&](OpBuilder &builder) {
    return cast<UnitCountOp>(builder.clone(*count)).getResult();
  });
}

/// Whether a value may differ between the threads of a block.
static bool isOfThread(Value value, gpu::LaunchOp launch) {
  if (value == launch.getThreadIds().x)
    return true;
  Operation *made = value.getDefiningOp();
  if (!made || !launch->isAncestor(made))
    return false;
  return made->getNumRegions() ||
         llvm::any_of(made->getOperands(), [&](Value operand) {
           return isOfThread(operand, launch);
         });
}

void piko::keepInBlock(scf::WhileOp loop, gpu::LaunchOp launch) {
  llvm::SetVector<Value> used;
  getUsedValuesDefinedAbove(loop->getRegions(), used);
  for (Value value : used) {
    Operation *made = value.getDefiningOp();
    if (!made || !launch->isProperAncestor(made) ||
        made->hasTrait<OpTrait::ConstantLike>() ||
        !value.getType().isIntOrIndexOrFloat() ||
        value.getType().isInteger(1) || isOfThread(value, launch))
      continue;
    Emitter b(loop.getLoc(), loop);
    Value memory = addSharedMemory(launch, 1, value.getType());
    loadForUses(value, loop, memory);
    b.store(value, memory, b.index(0));
  }
}
