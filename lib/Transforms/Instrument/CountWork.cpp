// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-count-work counts, in the process phase of each stage,
//   1. calls, and of each loop its iterations, where they begin;
//   2. emissions and accesses to state, before each, and those that are
//      effects for the innermost loop, too;
//   3. arithmetic, once for each block, at its begin.

#include "Piko/Transforms/Passes.h"

#include "Instrument/Counters.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Matchers.h"

namespace piko {
#define GEN_PASS_DEF_COUNTWORK
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct CountWorkPass : piko::impl::CountWorkBase<CountWorkPass> {
  void runOnOperation() override;
};

class WorkCounter {
public:
  WorkCounter(PipelineOp pipeline, Counters &counters)
      : pipeline(pipeline), counters(counters) {}
  void countStage(StageOp of);

private:
  void count(OpBuilder &builder, Location loc, int32_t counter, int64_t amount);
  void countBlock(Block &block);
  void countArithmetic(Block &block);
  /// Counts its iterations and what is in it, if the operation is a loop.
  bool countLoop(Operation *op);
  void countInside(Operation *op);
  void countAccess(Operation *op);
  void countElement(Operation *op, CounterKind kind, FlatSymbolRefAttr state,
                    ValueRange indices, StringRef field);

  PipelineOp pipeline;
  Counters &counters;
  StringAttr stage;                 ///< Its name.
  int32_t floats = 0, integers = 0; ///< The stage's counters.
  int32_t around = 0; ///< The counter of the innermost loop, or of calls.
  bool isInLoop = false;
};

} // namespace

void WorkCounter::count(OpBuilder &builder, Location loc, int32_t counter,
                        int64_t amount) {
  Value n = arith::ConstantIndexOp::create(builder, loc, amount);
  CountOp::create(builder, loc, counter, n);
}

void WorkCounter::countArithmetic(Block &block) {
  int64_t floatCount = 0, integerCount = 0;
  for (Operation &op : block)
    if (Type type = getComputedType(&op))
      ++(isa<FloatType>(type) ? floatCount : integerCount);
  auto builder = OpBuilder::atBlockBegin(&block);
  Location loc = block.getParentOp()->getLoc();
  if (floatCount)
    count(builder, loc, floats, floatCount);
  if (integerCount)
    count(builder, loc, integers, integerCount);
}

/// Of a loop whose body stands before its condition: the branch of the
/// body where another one does nothing but end the loop, as where the text's
/// own condition does not hold; else all of it.
static Block *getBodyBranch(scf::WhileOp loop) {
  auto goesOn = dyn_cast<OpResult>(loop.getConditionOp().getCondition());
  auto test = goesOn ? dyn_cast<scf::IfOp>(goesOn.getOwner()) : scf::IfOp();
  if (!test || test->getParentOp() != loop || !test.elseBlock())
    return loop.getBeforeBody();
  Block *branches[] = {test.thenBlock(), test.elseBlock()};
  for (unsigned i : {0, 1}) {
    Value flag =
        branches[i]->getTerminator()->getOperand(goesOn.getResultNumber());
    if (llvm::hasSingleElement(*branches[i]) && matchPattern(flag, m_Zero()))
      return branches[1 - i];
  }
  return loop.getBeforeBody();
}

/// The block of a loop that runs once for each iteration; null for what is
/// none.
static Block *getIteration(Operation *op) {
  if (auto loop = dyn_cast<ParallelLoopOpInterface>(op))
    return loop.getBodyBlock();
  if (auto loop = dyn_cast<scf::ForOp>(op))
    return loop.getBody();
  auto loop = dyn_cast<scf::WhileOp>(op);
  if (!loop)
    return nullptr;
  return llvm::hasSingleElement(*loop.getAfterBody()) ? getBodyBranch(loop)
                                                      : loop.getAfterBody();
}

void WorkCounter::countInside(Operation *op) {
  for (Region &region : op->getRegions())
    for (Block &inner : region)
      countBlock(inner);
}

bool WorkCounter::countLoop(Operation *op) {
  Block *iteration = getIteration(op);
  if (!iteration)
    return false;
  auto kind = isa<ParallelLoopOpInterface>(op) ? CounterKind::Iterations
                                               : CounterKind::Trips;
  int32_t outer = around;
  bool wasInLoop = std::exchange(isInLoop, true);
  around = counters.add(op->getLoc(), kind, stage, outer);
  countInside(op);
  isInLoop = wasInLoop;
  auto builder = OpBuilder::atBlockBegin(iteration);
  count(builder, op->getLoc(), around, 1);
  around = outer;
  return true;
}

void WorkCounter::countElement(Operation *op, CounterKind kind,
                               FlatSymbolRefAttr state, ValueRange indices,
                               StringRef field) {
  if (indices.empty())
    return; // a constant
  OpBuilder builder(op);
  Location loc = op->getLoc();
  int32_t counter = counters.getAccesses(loc, kind, stage, state);
  RecordOp record = lookupRecord(
      op, getStateRecord(lookupInPipeline<Operation *>(op, state)));
  int64_t offset = 0, bytes = record.getSize();
  if (!field.empty()) {
    FieldAttr leaf = record.getField(field);
    offset = leaf.getOffset();
    bytes = leaf.getType().getIntOrFloatBitWidth() / 8;
  }
  CountElementOp::create(builder, loc, counter, state.getValue(), indices,
                         static_cast<uint64_t>(bytes),
                         static_cast<uint64_t>(offset));
}

void WorkCounter::countAccess(Operation *op) {
  if (auto load = dyn_cast<LoadOp>(op))
    countElement(op, CounterKind::Reads, load.getStateAttr(), load.getIndices(),
                 load.getField());
  else if (auto store = dyn_cast<StoreOp>(op))
    countElement(op, CounterKind::Stores, store.getStateAttr(),
                 store.getIndices(), store.getField());
  else if (auto atomic = dyn_cast<AtomicOp>(op))
    countElement(op, CounterKind::Atomics, atomic.getStateAttr(),
                 atomic.getIndices(), atomic.getField());
  else if (auto update = dyn_cast<UpdateOp>(op))
    countElement(op, CounterKind::Updates, update.getImageAttr(),
                 update.getCoordinates(), "");
}

void WorkCounter::countBlock(Block &block) {
  for (Operation &op : llvm::make_early_inc_range(block)) {
    if (!countLoop(&op))
      countInside(&op);
    countAccess(&op);
    if (isInLoop && isa<EmissionOpInterface, UpdateOp, AtomicOp>(op)) {
      OpBuilder builder(&op);
      count(builder, op.getLoc(),
            counters.getEffects(op.getLoc(), stage, around), 1);
    }
    if (auto emission = dyn_cast<EmissionOpInterface>(op)) {
      OpBuilder builder(&op);
      count(builder, op.getLoc(),
            counters.getEmissions(op.getLoc(), stage, emission.getPort()), 1);
    }
  }
  countArithmetic(block);
}

void WorkCounter::countStage(StageOp of) {
  ProcessOp process = of.getProcess();
  if (!process)
    return;
  stage = StringAttr::get(of.getContext(), getCppName(of));
  Location loc = process.getLoc();
  int32_t calls = around = counters.add(loc, CounterKind::Calls, stage);
  floats = counters.add(loc, CounterKind::Floats, stage);
  integers = counters.add(loc, CounterKind::Integers, stage);
  Block &body = process.getBody().front();
  countBlock(body);
  auto builder = OpBuilder::atBlockBegin(&body);
  count(builder, loc, calls, 1);
}

void CountWorkPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  Counters known(pipeline);
  WorkCounter counter(pipeline, known);
  SmallVector<StageOp> stages(pipeline.getOps<StageOp>());
  for (StageOp stage : stages)
    counter.countStage(stage);
}
