// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "LanePlan.h"

#include "Piko/Analysis/Repeatable.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "StateAccess.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Transforms/RegionUtils.h"
#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;

static bool isOverPrimitives(scf::ForOp loop) {
  return loop->hasAttr(marks::lanes) &&
         loop->getParentOfType<scf::ForallOp>() && getKernelStage(loop) &&
         !loop.getNumResults() && matchPattern(loop.getStep(), m_One()) &&
         !loop.getBody()->getOps<ItemOp>().empty();
}

SmallVector<scf::ForOp> piko::findLoopsOverPrimitives(PipelineOp pipeline) {
  SmallVector<scf::ForOp> loops;
  pipeline.walk([&](scf::ForOp loop) {
    if (isOverPrimitives(loop))
      loops.push_back(loop);
  });
  return loops;
}

std::optional<LaneMapping> piko::getLaneMapping(scf::ForOp loop) {
  auto mapping = loop->getAttrOfType<LaneMappingAttr>(marks::mapping);
  return mapping ? std::optional(mapping.getValue()) : std::nullopt;
}

int64_t LanePlan::countKept() const {
  int64_t count = kept.size();
  for (const LaneBranch &branch : branches)
    count += branch.plan.countKept();
  return count;
}

void LanePlan::walk(llvm::function_ref<void(Operation *)> visit) const {
  for (Operation *op : ahead)
    op->walk(visit);
  for (const LaneBranch &branch : branches)
    branch.plan.walk(visit);
}

LanePlanner::LanePlanner(scf::ForOp loop)
    : loop(loop), written(getWrittenState(loop->getParentOfType<KernelOp>())) {}

bool LanePlanner::readsState() const {
  return llvm::any_of(fetched, [](Operation *op) { return isa<LoadOp>(op); });
}

LanePlan LanePlanner::run() {
  LanePlan plan = makePlan(*loop.getBody());
  findPrefetches();
  return plan;
}

int64_t LaneCost::getLeast() const {
  constexpr int64_t leastOperations = 32, leastForValue = 6;
  return std::max(leastOperations, leastForValue * values);
}

LaneCost LanePlanner::getCost(const LanePlan &plan) const {
  LaneCost cost;
  if (other)
    return cost;
  llvm::DenseSet<Value> read;
  plan.walk([&](Operation *op) {
    if (!isComputed(op))
      return;
    cost.operations += op->getParentOfType<scf::WhileOp>() ? weightInLoop : 1;
    for (Value operand : op->getOperands())
      if (isFetched(operand))
        read.insert(getFirst(operand));
  });
  cost.values = plan.countKept() + read.size();
  return cost;
}

//===----------------------------------------------------------------------===//
// What can run ahead
//===----------------------------------------------------------------------===//

bool LanePlanner::isInvariant(Value value) const {
  return !getLoop().getRegion().isAncestor(value.getParentRegion()) ||
         uniform.contains(value) || invariant.contains(value.getDefiningOp());
}

bool LanePlanner::isComputed(Operation *op) const {
  if (!taken.contains(op) || op->getNumRegions() || invariant.contains(op) ||
      fetched.contains(op))
    return false;
  for (Region *region = op->getParentRegion(); region != &getLoop().getRegion();
       region = region->getParentRegion())
    if (rare.contains(region))
      return false;
  return true;
}

bool LanePlanner::isGlobal(Value value) const {
  return !getLoop().getRegion().isAncestor(value.getParentRegion()) ||
         global.contains(value.getDefiningOp());
}

bool LanePlanner::isAvailable(Value value) const {
  return isInvariant(value) || value == getLoop().getInductionVar() ||
         variables.contains(value) || taken.contains(value.getDefiningOp());
}

bool LanePlanner::readsFixedState(Operation *op) const {
  auto load = dyn_cast<LoadOp>(op);
  return load && !written.contains(load.getStateAttr().getAttr());
}

static bool areConstant(ValueRange values) {
  return llvm::all_of(values,
                      [](Value v) { return matchPattern(v, m_Constant()); });
}

bool LanePlanner::isAddress(Value value) const {
  return isGlobal(value) || value == getLoop().getInductionVar() ||
         isFetched(value) || addresses.contains(value.getDefiningOp());
}

bool LanePlanner::isFixed(Value array) const {
  return array.getDefiningOp<memref::AllocaOp>() && isInvariant(array) &&
         llvm::all_of(array.getUsers(), [&](Operation *user) {
           return isa<memref::LoadOp>(user) ||
                  (isa<memref::StoreOp>(user) && !getLoop()->isAncestor(user));
         });
}

bool LanePlanner::isFetch(Operation *op) const {
  if (auto item = dyn_cast<ItemOp>(op))
    return isAddress(item.getPosition());
  if (auto get = dyn_cast<GetOp>(op))
    return isFetched(get.getPrim()) && areConstant(get.getElements());
  if (auto kept = dyn_cast<memref::LoadOp>(op))
    return kept->getBlock() == getLoop().getBody() &&
           isFixed(kept.getMemRef()) &&
           llvm::all_of(kept.getIndices(),
                        [&](Value index) { return isAddress(index); });
  auto load = dyn_cast<LoadOp>(op);
  return load && !load.getIndices().empty() && readsFixedState(load) &&
         areConstant(load.getElements()) &&
         llvm::all_of(load.getIndices(),
                      [&](Value index) { return isAddress(index); });
}

/// Of numbers as lanes have them: wider ones would be cut into pieces.
static bool areScalar(TypeRange types) {
  return llvm::all_of(types, [](Type type) {
    return type.isIndex() ||
           (type.isIntOrFloat() && type.getIntOrFloatBitWidth() <= 64);
  });
}

/// Whether vectors can do what an operation does, whether its result is wanted
/// or not: the same operation on each number, to the last bit.
static bool isForLanes(Operation *op) {
  bool isKnown = isa<arith::ArithDialect>(op->getDialect()) ||
                 isa<math::AbsFOp, math::AbsIOp, math::CeilOp, math::CopySignOp,
                     math::FloorOp, math::FmaOp, math::RoundEvenOp,
                     math::SqrtOp, math::TruncOp>(op);
  if (!isKnown || !isSpeculatable(op) || !op->hasTrait<OpTrait::Elementwise>())
    return false;
  return areScalar(op->getResultTypes());
}

/// Whether an operation is cheap enough to compute what is read next.
static bool isForAddresses(Operation *op) {
  return isa<arith::IndexCastOp, arith::IndexCastUIOp, arith::ExtSIOp,
             arith::ExtUIOp, arith::TruncIOp, arith::AddIOp, arith::SubIOp,
             arith::MulIOp, arith::MinSIOp, arith::MaxSIOp>(op);
}

bool LanePlanner::isUniform(Operation *op) const {
  if (!op->getNumResults() ||
      !llvm::all_of(op->getOperands(), [&](Value v) { return isInvariant(v); }))
    return false;
  if (auto load = dyn_cast<LoadOp>(op))
    return readsFixedState(load) && areConstant(load.getElements());
  return isRepeatable(op);
}

void LanePlanner::noteRead(LoadOp load) {
  SmallVectorImpl<LoadOp> &known = loads[load.getFieldAttr()];
  auto first = llvm::find_if(known, [&](LoadOp other) {
    return other.getStateAttr() == load.getStateAttr() &&
           llvm::equal(other.getIndices(), load.getIndices()) &&
           llvm::equal(other.getElements(), load.getElements());
  });
  if (first == known.end())
    known.push_back(load);
  else if (*first != load)
    same[load] = *first;
}

bool LanePlanner::take(Operation *op) {
  if (auto choice = dyn_cast<scf::IfOp>(op)) {
    if (!takeCondition(choice))
      return false;
  } else if (auto inner = dyn_cast<scf::WhileOp>(op)) {
    if (!takeLoop(inner))
      return false;
  } else if (!llvm::all_of(op->getOperands(),
                           [&](Value v) { return isAvailable(v); })) {
    return false;
  } else if (isUniform(op)) {
    invariant.insert(op);
    if (llvm::all_of(op->getOperands(), [&](Value v) { return isGlobal(v); }))
      global.insert(op);
  } else if (isFetch(op)) {
    fetched.insert(op);
    if (auto load = dyn_cast<LoadOp>(op))
      noteRead(load);
  } else if (!isForLanes(op)) {
    obstacles.push_back({op});
    return false;
  } else if (isForAddresses(op) &&
             llvm::all_of(op->getOperands(),
                          [&](Value v) { return isAddress(v); })) {
    addresses.insert(op);
  }
  taken.insert(op);
  return true;
}

void LanePlanner::forget(Operation *op) {
  op->walk([&](Operation *inner) {
    for (llvm::DenseSet<Operation *> *set :
         {&taken, &invariant, &global, &fetched, &addresses})
      set->erase(inner);
    if (auto load = dyn_cast<LoadOp>(inner)) {
      llvm::erase(loads[load.getFieldAttr()], load);
      same.erase(load);
    }
    SmallVector<Value> values(inner->getResults());
    for (Region &region : inner->getRegions())
      llvm::append_range(values, region.getArguments());
    for (Value value : values) {
      variables.erase(value);
      uniform.erase(value);
    }
  });
}

bool LanePlanner::takeLoop(scf::WhileOp inner) {
  if (!llvm::all_of(inner.getInits(), [&](Value v) { return isAvailable(v); }))
    return false;
  bool isScalar = areScalar(inner.getInits().getTypes()) &&
                  areScalar(inner.getResultTypes());
  // Of a loop that is entered only now and then, not even the number of its
  // iterations would be known to be finite elsewhere.
  if (conditions || !isScalar) {
    addObstacle(inner,
                isScalar ? LaneObstacle::isEntered : LaneObstacle::holds);
    return false;
  }
  SmallVector<bool> same;
  for (Value init : inner.getInits())
    same.push_back(isInvariant(init));
  while (true) {
    SmallVector<bool> before = same;
    bool isTaken = takeLoop(inner, same);
    if (isTaken && before == same)
      return true;
    forget(inner);
    if (!isTaken)
      return false;
  }
}

bool LanePlanner::takeLoop(scf::WhileOp inner, SmallVector<bool> &same) {
  auto add = [&](Value value, bool isSame) {
    variables.insert(value);
    if (isSame)
      uniform.insert(value);
    else
      uniform.erase(value);
  };
  for (auto [argument, isSame] :
       llvm::zip_equal(inner.getBeforeArguments(), same))
    add(argument, isSame);
  scf::ConditionOp condition = inner.getConditionOp();
  if (!takeRegion(inner.getBefore())) {
    addObstacle(inner, LaneObstacle::holds);
    return false;
  }
  if (!isInvariant(condition.getCondition())) {
    addObstacle(inner, LaneObstacle::differs);
    return false;
  }
  for (auto [value, argument, result] :
       llvm::zip_equal(condition.getArgs(), inner.getAfterArguments(),
                       inner.getResults())) {
    add(argument, isInvariant(value));
    add(result, isInvariant(value));
  }
  if (!takeRegion(inner.getAfter())) {
    addObstacle(inner, LaneObstacle::holds);
    return false;
  }
  for (auto [value, isSame] :
       llvm::zip_equal(inner.getYieldOp().getResults(), same))
    isSame = isSame && isInvariant(value);
  return true;
}

bool LanePlanner::takeCondition(scf::IfOp choice) {
  if (!choice.getNumResults() || !areScalar(choice.getResultTypes()) ||
      !isAvailable(choice.getCondition()))
    return false;
  Region &then = choice.getThenRegion(), &other = choice.getElseRegion();
  ++conditions;
  bool takesThen = takeRegion(then), takesOther = takeRegion(other);
  --conditions;
  if (takesThen && takesOther)
    return true;
  // A side without any work would leave nothing to the lanes.
  Region &kept = takesThen ? then : other, &left = takesThen ? other : then;
  if ((!takesThen && !takesOther) ||
      kept.front().without_terminator().empty() || !isPrivate(left))
    return false;
  rare.insert(&left);
  return true;
}

bool LanePlanner::takeRegion(Region &region) {
  Operation *end = region.front().getTerminator();
  for (Operation &op : region.front().without_terminator())
    if (!take(&op))
      return false;
  return llvm::all_of(end->getOperands(),
                      [&](Value v) { return isAvailable(v); });
}

bool LanePlanner::isPrivate(Region &region) const {
  auto isOwn = [&](Value memory) {
    auto array = memory.getDefiningOp<memref::AllocaOp>();
    return array && llvm::all_of(array->getUsers(), [&](Operation *user) {
             return region.isAncestor(user->getParentRegion());
           });
  };
  WalkResult result = region.walk([&](Operation *op) {
    bool isHarmless =
        llvm::TypeSwitch<Operation *, bool>(op)
            .Case<memref::LoadOp, memref::StoreOp>(
                [&](auto access) { return isOwn(access.getMemRef()); })
            .Case<memref::AllocaOp, scf::IfOp, scf::ForOp, scf::WhileOp,
                  scf::IndexSwitchOp>([](auto) { return true; })
            .Default([&](Operation *other) {
              return readsFixedState(other) ||
                     (!other->getNumRegions() && isMemoryEffectFree(other));
            });
    return isHarmless ? WalkResult::advance() : WalkResult::interrupt();
  });
  if (result.wasInterrupted())
    return false;
  llvm::SetVector<Value> used;
  getUsedValuesDefinedAbove(region, used);
  return llvm::all_of(used, [&](Value v) {
    return isAvailable(v) || v.getDefiningOp<memref::AllocaOp>();
  });
}

//===----------------------------------------------------------------------===//
// What cannot
//===----------------------------------------------------------------------===//

void LanePlanner::addObstacle(scf::WhileOp loop, LaneObstacle::Reason reason) {
  LaneObstacle obstacle{loop, reason};
  // One obstacle stands for all that the loop holds, and an effect for those
  // that could go if it did.
  llvm::erase_if(obstacles, [&](const LaneObstacle &other) {
    bool isInside = loop->isProperAncestor(other.op);
    if (isInside)
      obstacle.inner = other.inner ? other.inner : other.op;
    return isInside;
  });
  loop->walk([&](Operation *op) {
    bool isEffect = !op->getNumRegions() && !isMemoryEffectFree(op) &&
                    !isa<LoadOp, memref::LoadOp, memref::StoreOp>(op);
    if (!isEffect && !isa<UpdateOp>(op))
      return WalkResult::advance();
    obstacle.inner = op;
    return WalkResult::interrupt();
  });
  // Or else what it needs is not there.
  if (obstacle.inner || reason != LaneObstacle::holds)
    obstacles.push_back(obstacle);
}

int64_t LanePlanner::countHeldUp(Operation *obstacle) const {
  int64_t count = 0;
  llvm::DenseSet<Operation *> seen;
  SmallVector<Operation *> next = {obstacle};
  while (!next.empty()) {
    Operation *op = next.pop_back_val();
    if (!seen.insert(op).second)
      continue;
    count += op != obstacle && isForLanes(op) && !isComputed(op);
    for (Region &region : op->getRegions())
      for (Operation &inner : region.getOps())
        next.push_back(&inner);
    llvm::append_range(next, op->getUsers());
  }
  return count;
}

SmallVector<LaneObstacle> LanePlanner::getObstacles() const {
  constexpr size_t most = 3;
  llvm::DenseMap<Operation *, int64_t> held;
  SmallVector<LaneObstacle> result;
  for (const LaneObstacle &obstacle : obstacles) {
    bool isTaken = false;
    for (Operation *op = obstacle.op; op != loop && !isTaken;
         op = op->getParentOp())
      isTaken = taken.contains(op);
    if (isTaken || held.contains(obstacle.op))
      continue;
    held[obstacle.op] = countHeldUp(obstacle.op);
    if (held[obstacle.op])
      result.push_back(obstacle);
  }
  llvm::DenseMap<Operation *, int64_t> places;
  loop->walk<WalkOrder::PreOrder>(
      [&](Operation *op) { places.try_emplace(op, places.size()); });
  llvm::sort(result, [&](const LaneObstacle &a, const LaneObstacle &b) {
    return std::pair(-held.lookup(a.op), places.lookup(a.op)) <
           std::pair(-held.lookup(b.op), places.lookup(b.op));
  });
  result.truncate(std::min(result.size(), most));
  // The order in which the loop holds them.
  llvm::sort(result, [&](const LaneObstacle &a, const LaneObstacle &b) {
    return places.lookup(a.op) < places.lookup(b.op);
  });
  return result;
}

void LanePlanner::findPrefetches() {
  for (Operation &op : loop.getBody()->without_terminator())
    if (isa<PrefetchOp, PrefetchItemOp>(op) &&
        llvm::all_of(op.getOperands(), [&](Value v) { return isAddress(v); }))
      prefetches.push_back(&op);
}

//===----------------------------------------------------------------------===//
// Plans
//===----------------------------------------------------------------------===//

LanePlan LanePlanner::makePlan(Block &block) {
  LanePlan plan;
  plan.block = &block;
  for (Operation &op : block.without_terminator())
    if (take(&op))
      plan.ahead.insert(&op);
  for (auto choice : block.getOps<scf::IfOp>())
    if (!choice.getNumResults() && isAvailable(choice.getCondition()))
      addBranch(plan, choice);
  dropUseless(plan);
  findRepeated(plan);
  findKept(plan);
  return plan;
}

static int64_t countOperations(Region &region) {
  int64_t count = 0;
  region.walk([&](Operation *) { ++count; });
  return count;
}

void LanePlanner::addBranch(LanePlan &plan, scf::IfOp choice) {
  // Of two sides the shorter one is taken for the common one: lanes would have
  // to run both.
  std::optional<LaneBranch> best;
  for (Region &region : choice->getRegions()) {
    if (region.empty())
      continue;
    LanePlan side = makePlan(region.front());
    if (!side.countKept() ||
        (best && countOperations(region) >=
                     countOperations(choice->getRegion(best->region))))
      continue;
    best = {choice, region.getRegionNumber(), std::move(side)};
  }
  if (best)
    plan.branches.push_back(std::move(*best));
}

bool LanePlanner::isNeeded(Operation *read, const LanePlan &plan) const {
  return llvm::any_of(read->getUsers(), [&](Operation *user) {
    return taken.contains(user) || taken.contains(user->getParentOp()) ||
           llvm::any_of(plan.branches, [&](const LaneBranch &branch) {
             return branch.choice == user;
           });
  });
}

void LanePlanner::dropUseless(LanePlan &plan) {
  for (Operation *op : llvm::to_vector(llvm::reverse(plan.ahead)))
    if (isa<LoadOp>(op) && fetched.contains(op) && !isNeeded(op, plan)) {
      plan.ahead.remove(op);
      taken.erase(op);
    }
}

void LanePlanner::findRepeated(LanePlan &plan) {
  auto isAtHand = [&](Value value) {
    return isGlobal(value) || value == getLoop().getInductionVar() ||
           repeated.contains(value.getDefiningOp());
  };
  for (Operation *op : plan.ahead)
    if (isa<ItemOp, GetOp, memref::LoadOp>(op) || invariant.contains(op))
      if (llvm::all_of(op->getOperands(), isAtHand)) {
        plan.repeated.insert(op);
        repeated.insert(op);
      }
}

void LanePlanner::findKept(LanePlan &plan) {
  llvm::DenseSet<Operation *> ahead;
  plan.walk([&](Operation *op) { ahead.insert(op); });
  auto isAhead = [&](Operation *user) {
    return ahead.contains(user) || ahead.contains(user->getParentOp());
  };
  for (Operation *op : plan.ahead)
    if (!plan.repeated.contains(op))
      for (Value result : op->getResults())
        if (!llvm::all_of(result.getUsers(), isAhead)) {
          plan.kept.push_back(result);
          if (!areScalar(result.getType()))
            other = result;
        }
}
