// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Marks, from effects backwards, what they are computed from.

#include "Authored/PipelineLiveness.h"

#include "Piko/Analysis/StageGraph.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Effects
//===----------------------------------------------------------------------===//

/// Control flow that is as live as what is in it or comes out of it.
static bool isControlFlow(Operation *op) {
  return isa<scf::IfOp, scf::ForOp, scf::WhileOp, scf::IndexSwitchOp,
             ParallelLoopOpInterface>(op);
}

/// Whether an operation of a live stage is needed even if nobody reads what it
/// gives. Accesses that are only read from are not: one that nobody needs is
/// not made, wherever it would have been.
static bool hasEffect(Operation *op) {
  if (isControlFlow(op) || op->hasTrait<OpTrait::IsTerminator>() ||
      isa<EmissionOpInterface, memref::StoreOp>(op))
    return false;
  return !wouldOpBeTriviallyDead(op);
}

static Value stripIndexCasts(Value value) {
  while (auto cast = value.getDefiningOp<arith::IndexCastOp>())
    value = cast.getIn();
  return value;
}

/// Whether a comparison with a constant tells of a bin from `piko.bin_at`, when
/// it gives `truth`, that it is not -1.
static bool tellsInside(arith::CmpIOp test, Value bin, bool truth) {
  using P = arith::CmpIPredicate;
  APInt constant;
  if (stripIndexCasts(test.getLhs()) != bin ||
      !matchPattern(test.getRhs(), m_ConstantInt(&constant)))
    return false;
  P predicate =
      truth ? test.getPredicate() : arith::invertPredicate(test.getPredicate());
  return (predicate == P::sge && constant.isZero()) ||
         (predicate == P::sgt && constant.isAllOnes()) ||
         (predicate == P::ne && constant.isAllOnes());
}

/// Whether the bin is surely in the grid: 0, or what `piko.bin_at` gave and a
/// test around the assignment found to be a bin.
static bool isSurelyInside(AssignToOp assign) {
  if (matchPattern(assign.getBin(), m_Zero()))
    return true;
  Value bin = stripIndexCasts(assign.getBin());
  if (!bin.getDefiningOp<BinAtOp>())
    return false;
  for (Operation *op = assign; auto test = op->getParentOfType<scf::IfOp>();
       op = test) {
    auto condition = test.getCondition().getDefiningOp<arith::CmpIOp>();
    bool truth = test.getThenRegion().isAncestor(op->getParentRegion());
    if (condition && tellsInside(condition, bin, truth))
      return true;
  }
  return false;
}

/// Whether a stage changes state or may end the run with an error.
static bool canBeObserved(StageOp stage) {
  // Hops are limited, and so are the numbers that a dynamic schedule gives.
  ScheduleOp schedule = stage.getSchedule();
  if (isOnCycle(stage) || (schedule && !schedule.getBody().empty()))
    return true;
  return stage
      .walk([](Operation *op) {
        auto assignment = dyn_cast<AssignmentOpInterface>(op);
        if (isa<StageOp, ScheduleOp, AssignOp, ProcessOp, OwnerOp>(op) ||
            (assignment && !assignment.canFail()))
          return WalkResult::advance();
        auto assign = dyn_cast<AssignToOp>(op);
        return (assign ? isSurelyInside(assign) : !hasEffect(op))
                   ? WalkResult::advance()
                   : WalkResult::interrupt();
      })
      .wasInterrupted();
}

//===----------------------------------------------------------------------===//
// The graph
//===----------------------------------------------------------------------===//

PipelineLiveness::PipelineLiveness(PipelineOp pipeline) {
  for (auto edge : pipeline.getOps<EdgeOp>()) {
    auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
    auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
    inputs[consumer].push_back({producer, edge.getPort()});
    producers[consumer].push_back(producer);
  }
  for (auto stage : pipeline.getOps<StageOp>())
    stage.walk([&](EmissionOpInterface emit) {
      emits[{stage, emit.getPort()}].push_back(emit);
    });
  for (auto stage : pipeline.getOps<StageOp>())
    if (canBeObserved(stage))
      markStage(stage);
  while (!worklist.empty())
    visit(worklist.pop_back_val());
}

ArrayRef<StageOp> PipelineLiveness::producersOf(StageOp stage) const {
  auto it = producers.find(stage);
  return it == producers.end() ? ArrayRef<StageOp>() : it->second;
}

void PipelineLiveness::markStage(StageOp stage) {
  if (!liveStages.insert(stage).second)
    return;
  stage.walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (isa<ScheduleOp>(op))
      return WalkResult::skip();
    if (!isa<StageOp, AssignOp, ProcessOp>(op) && hasEffect(op))
      markOp(op);
    return WalkResult::advance();
  });
  for (Input input : inputs.lookup(stage)) {
    for (EmissionOpInterface emit : emits.lookup({input.producer, input.port}))
      markOp(emit);
    markStage(input.producer);
  }
}

/// A field that is read is one that all its producers compute.
void PipelineLiveness::markField(StageOp stage, FieldAttr field) {
  if (!liveFields.insert({stage, field}).second)
    return;
  RecordOp record = lookupRecord(stage, stage.getInputAttr());
  int64_t first = 0;
  for (auto other : record.getFields().getAsRange<FieldAttr>()) {
    if (other == field)
      break;
    first += other.getElementCount();
  }
  for (Input input : inputs.lookup(stage))
    for (EmissionOpInterface emit : emits.lookup({input.producer, input.port}))
      markValues(
          ValueRange(emit.getNumbers()).slice(first, field.getElementCount()));
}

//===----------------------------------------------------------------------===//
// Bodies
//===----------------------------------------------------------------------===//

void PipelineLiveness::markOp(Operation *op) {
  if (liveOps.insert(op).second)
    worklist.push_back(op);
}

/// Marks what a live operation needs whichever of its results are live.
void PipelineLiveness::visit(Operation *op) {
  if (Operation *parent = op->getParentOp(); !isa<AssignOp, ProcessOp>(parent))
    markOp(parent);
  if (auto emit = dyn_cast<EmissionOpInterface>(op)) {
    // Its fields are marked one by one.
    SmallVector<Value> numbers = emit.getNumbers();
    for (Value operand : op->getOperands())
      if (!llvm::is_contained(numbers, operand))
        markValue(operand);
    return;
  }
  if (auto loop = dyn_cast<scf::ForOp>(op))
    return markValues(
        {loop.getLowerBound(), loop.getUpperBound(), loop.getStep()});
  if (auto loop = dyn_cast<scf::WhileOp>(op))
    return markValue(loop.getConditionOp().getCondition());
  markValues(op->getOperands());
  if (auto get = dyn_cast<GetOp>(op)) {
    StageOp stage = getPhaseStage(op);
    RecordOp record = lookupRecord(stage, stage.getInputAttr());
    return markField(stage, record.getField(get.getField()));
  }
  if (isControlFlow(op))
    return;
  for (Region &region : op->getRegions())
    for (Block &block : region)
      markValues(block.getTerminator()->getOperands());
}

void PipelineLiveness::markValue(Value value) {
  if (!liveValues.insert(value).second)
    return;
  if (isa<MemRefType>(value.getType()))
    markUsersOfMemory(value);
  if (auto argument = dyn_cast<BlockArgument>(value)) {
    Operation *owner = argument.getOwner()->getParentOp();
    if (isa<AssignOp, ProcessOp>(owner))
      return;
    markOp(owner);
    markIncoming(owner, argument.getParentRegion(), argument.getArgNumber());
    return;
  }
  markOp(value.getDefiningOp());
  markIncoming(value.getDefiningOp(), nullptr,
               cast<OpResult>(value).getResultNumber());
}

/// `region` is null for results.
void PipelineLiveness::markIncoming(Operation *op, Region *region,
                                    unsigned number) {
  if (auto loop = dyn_cast<scf::ForOp>(op)) {
    if (region && number == 0)
      return;
    unsigned carried = region ? number - 1 : number;
    markValue(loop.getInitArgs()[carried]);
    markValue(loop.getBody()->getTerminator()->getOperand(carried));
  } else if (auto loop = dyn_cast<scf::WhileOp>(op)) {
    if (region == &loop.getBefore()) {
      markValue(loop.getInits()[number]);
      markValue(loop.getYieldOp().getOperand(number));
    } else {
      markValue(loop.getConditionOp().getArgs()[number]);
    }
  } else if (isa<scf::IfOp, scf::IndexSwitchOp>(op)) {
    for (Region &branch : op->getRegions())
      markValue(branch.front().getTerminator()->getOperand(number));
  }
}

/// What is stored in memory that is read is live, too.
void PipelineLiveness::markUsersOfMemory(Value memory) {
  for (Operation *user : memory.getUsers()) {
    if (user->hasTrait<OpTrait::IsTerminator>()) {
      // The memory may leave the operation under any of its names.
      markValues(user->getParentOp()->getResults());
      markValues(user->getOperands());
    } else if (!wouldOpBeTriviallyDead(user) || isControlFlow(user)) {
      markOp(user);
      for (Region &region : user->getRegions())
        markValues(region.getArguments());
      markValues(user->getResults());
    } else {
      for (Value result : user->getResults())
        if (isa<MemRefType>(result.getType()))
          markValue(result);
    }
  }
}
