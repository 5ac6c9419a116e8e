// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-vectorize: what only computes goes ahead of what has effects, for a
// block of primitives at a time and in vectors.
//
// A lane that comes to an index outside of its buffer, or to the rare side of a
// condition, gives up: its primitive goes through the original body, with all
// that it says about errors.

#include "LaneReport.h"
#include "LaneWriter.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/PatternMatch.h"

namespace piko {
#define GEN_PASS_DEF_VECTORIZE
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct VectorizePass : piko::impl::VectorizeBase<VectorizePass> {
  void runOnOperation() override;
};

/// One loop over primitives becomes a loop over blocks of them with three loops
/// inside.
class LoopVectorizer {
public:
  LoopVectorizer(scf::ForOp loop, StageOp stage, LanePlan plan,
                 const LanePlanner &planner)
      : loop(loop), stage(stage), plan(std::move(plan)), planner(planner),
        loc(loop.getLoc()), builder(loop), blocks(createBlocks()),
        slots(blocks) {}
  void run();

private:
  scf::ForOp createBlocks();
  void createVectors(Value begin, Value end);
  void createFetches(Value begin, Value end);
  void createRest(Value begin, Value end);
  /// Replaces what has run ahead.
  void reduce(LanePlan &plan, Value place);

  scf::ForOp loop;
  StageOp stage;
  LanePlan plan;
  const LanePlanner &planner;
  Location loc;
  OpBuilder builder;
  scf::ForOp blocks;
  LaneSlots slots;
  Value outside; // an array: whether a primitive read outside of a buffer
  Value gaveUp;  // an array: whether its lane gave up
};

} // namespace

//===----------------------------------------------------------------------===//
// The three loops
//===----------------------------------------------------------------------===//

scf::ForOp LoopVectorizer::createBlocks() {
  Value size = arith::ConstantIndexOp::create(builder, loc, laneBlockSize);
  return scf::ForOp::create(builder, loc, loop.getLowerBound(),
                            loop.getUpperBound(), size);
}

void LoopVectorizer::createVectors(Value begin, Value end) {
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value step = arith::ConstantIndexOp::create(builder, loc, laneCount);
  Value count = arith::SubIOp::create(builder, loc, end, begin);
  auto groups = scf::ForOp::create(builder, loc, zero, count, step);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(groups.getBody());
  Value place = groups.getInductionVar();
  Type bit = builder.getI1Type();
  outside = slots.create(bit);
  VectorWriter writer(builder, stage, planner, slots, begin, count, place,
                      outside);
  writer.write(plan);
  SmallVector<Value> kept;
  auto collect = [&](auto &self, const LanePlan &plan) -> void {
    llvm::append_range(kept, plan.kept);
    for (const LaneBranch &branch : plan.branches)
      self(self, branch.plan);
  };
  collect(collect, plan);
  for (Value value : kept) {
    value = planner.getFirst(value);
    Value computed = writer.get(value);
    if (slots.contains(value))
      continue; // was read
    slots.add(value);
    slots.store(builder, computed, slots.get(value), place);
  }
  bool reads = planner.readsState();
  if (reads)
    gaveUp = outside;
  if (Value rare = writer.getRare()) {
    if (reads)
      rare = arith::OrIOp::create(
          builder, loc, rare,
          slots.load(builder, outside, place, getVectorType(bit)));
    gaveUp = slots.create(bit);
    slots.store(builder, rare, gaveUp, place);
  }
}

void LoopVectorizer::createFetches(Value begin, Value end) {
  auto fetches = scf::ForOp::create(builder, loc, begin, end, loop.getStep());
  fetches->setAttr(marks::reads, builder.getUnitAttr());
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(fetches.getBody());
  Value iteration = fetches.getInductionVar();
  Value place = arith::SubIOp::create(builder, loc, iteration, begin);
  FetchWriter writer(builder, stage, planner, iteration);
  for (Operation *op : planner.getPrefetches())
    writer.repeat(op);
  // Elements in the order in which they are read first.
  SmallVector<SmallVector<LoadOp>> elements;
  for (auto [value, slot] : slots.getAll())
    if (auto load = value.getDefiningOp<LoadOp>();
        load && planner.isFetched(value)) {
      auto known = llvm::find_if(elements, [&](ArrayRef<LoadOp> loads) {
        LoadOp other = loads.front();
        return other.getStateAttr() == load.getStateAttr() &&
               llvm::equal(other.getIndices(), load.getIndices());
      });
      if (known == elements.end())
        elements.push_back({load});
      else
        known->push_back(load);
    }
  for (ArrayRef<LoadOp> loads : elements)
    writer.getElement(loads);
  for (auto [value, slot] : slots.getAll())
    if (planner.isFetched(value))
      slots.store(builder, writer.get(value), slot, place);
  Value inside = writer.getInside();
  if (outside.use_empty() && gaveUp != outside)
    return;
  Value yes =
      arith::ConstantOp::create(builder, loc, builder.getBoolAttr(true));
  slots.store(builder,
              arith::XOrIOp::create(builder, loc, inside ? inside : yes, yes),
              outside, place);
}

void LoopVectorizer::reduce(LanePlan &plan, Value place) {
  // What the kept values are computed from comes first.
  Operation *head =
      place.getParentBlock() == plan.block ? place.getDefiningOp() : nullptr;
  auto lift = [&](Operation *op) {
    if (head)
      op->moveAfter(head);
    else
      op->moveBefore(plan.block, plan.block->begin());
    head = op;
  };
  for (Operation *op : plan.repeated)
    lift(op);
  if (head)
    builder.setInsertionPointAfter(head);
  else
    builder.setInsertionPointToStart(plan.block);
  llvm::DenseMap<Value, Value> loaded;
  for (Value kept : plan.kept) {
    Value first = planner.getFirst(kept);
    Value &value = loaded[first];
    if (!value)
      value = slots.load(builder, slots.get(first), place, kept.getType());
    kept.replaceAllUsesWith(value);
  }
  for (LaneBranch &branch : plan.branches)
    reduce(branch.plan, place);
  for (Operation *op : llvm::reverse(plan.ahead))
    if (!plan.repeated.contains(op))
      op->erase();
}

void LoopVectorizer::createRest(Value begin, Value end) {
  loop.getLowerBoundMutable().assign(begin);
  loop.getUpperBoundMutable().assign(end);
  loop->removeAttr(marks::lanes);
  for (Operation *op : planner.getPrefetches())
    op->erase();
  Block *body = loop.getBody();
  auto original = llvm::make_range(body->begin(), std::prev(body->end()));
  builder.setInsertionPointToStart(body);
  Value place =
      arith::SubIOp::create(builder, loc, loop.getInductionVar(), begin);
  if (gaveUp) {
    Value again = slots.load(builder, gaveUp, place, builder.getI1Type());
    auto choice = scf::IfOp::create(builder, loc, again, /*withElse=*/true);
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(choice.thenBlock());
    IRMapping mapping;
    for (Operation &op : original)
      builder.clone(op, mapping);
    Block *other = choice.elseBlock();
    other->getOperations().splice(other->begin(), body->getOperations(),
                                  original.begin(), original.end());
    plan.block = other;
  }
  reduce(plan, place);
}

void LoopVectorizer::run() {
  builder.setInsertionPointToStart(blocks.getBody());
  Value begin = blocks.getInductionVar();
  Value end = arith::MinSIOp::create(
      builder, loc,
      arith::AddIOp::create(builder, loc, begin, blocks.getStep()),
      blocks.getUpperBound());
  loop->moveBefore(blocks.getBody()->getTerminator());
  builder.setInsertionPoint(loop);
  // What is read is known when all is written that is computed from it.
  createVectors(begin, end);
  builder.setInsertionPoint(loop->getPrevNode());
  createFetches(begin, end);
  createRest(begin, end);
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

/// Turns choices between two sides into conditions.
static void simplifySwitches(scf::ForOp loop) {
  IRRewriter rewriter(loop.getContext());
  loop.walk([&](scf::IndexSwitchOp choice) {
    if (choice.getNumCases() != 1)
      return;
    Location loc = choice.getLoc();
    rewriter.setInsertionPoint(choice);
    Value expected = arith::ConstantIndexOp::create(rewriter, loc,
                                                    choice.getCases().front());
    Value isCase = arith::CmpIOp::create(
        rewriter, loc, arith::CmpIPredicate::eq, choice.getArg(), expected);
    auto condition =
        scf::IfOp::create(rewriter, loc, choice.getResultTypes(), isCase,
                          /*addThenBlock=*/false, /*addElseBlock=*/false);
    rewriter.inlineRegionBefore(choice.getCaseRegions().front(),
                                condition.getThenRegion(),
                                condition.getThenRegion().begin());
    rewriter.inlineRegionBefore(choice.getDefaultRegion(),
                                condition.getElseRegion(),
                                condition.getElseRegion().begin());
    rewriter.replaceOp(choice, condition);
  });
}

/// Whether a loop becomes vectors: where lanes are given something by the
/// schedule, that counts; elsewhere it does if it pays.
static bool obeyMapping(scf::ForOp loop, StageOp stage, LaneCost cost) {
  std::optional<LaneMapping> lanes = getLaneMapping(loop);
  if (lanes == LaneMapping::One)
    return false;
  ScheduleOp schedule = stage.getSchedule();
  bool isSaid = lanes == LaneMapping::Items && schedule &&
                schedule.getLanes() == LaneMapping::Items &&
                getLoopPhase(loop) == "process";
  return isSaid ? cost.operations > 0 : cost.isWorthwhile();
}

void VectorizePass::runOnOperation() {
  LaneReport report(getOperation());
  for (scf::ForOp loop : findLoopsOverPrimitives(getOperation())) {
    StageOp stage = getKernelStage(loop);
    simplifySwitches(loop);
    LanePlanner planner(loop);
    LanePlan plan = planner.run();
    LaneCost cost = planner.getCost(plan);
    bool isVectorized = obeyMapping(loop, stage, cost);
    report.add(loop, planner, cost, isVectorized);
    if (!isVectorized) {
      ++left;
      continue;
    }
    kept += plan.countKept();
    LoopVectorizer(loop, stage, std::move(plan), planner).run();
    ++vectorized;
  }
  report.emit();
}
